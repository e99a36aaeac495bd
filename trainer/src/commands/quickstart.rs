//! `trainer quickstart`
use clap::Args;
/// Q
#[derive(Args)]
pub(crate) struct Quickstart {}
impl Quickstart {
    pub(crate) fn run(&self, _seed: u64) -> anyhow::Result<()> {
        Ok(())
    }
}
