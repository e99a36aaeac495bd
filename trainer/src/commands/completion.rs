//! `trainer completion`

use clap::Args;
use clap_complete::{Shell, generate};

use super::print;

/// Print a script by which a shell completes this program's commands and options.
///
/// Example: trainer completion bash > ~/.local/share/bash-completion/completions/trainer
///          trainer completion zsh > ~/.zfunc/_trainer
///          trainer completion fish > ~/.config/fish/completions/trainer.fish
#[derive(Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Completion {
    /// The shell
    #[arg(value_enum)]
    shell: Shell,
}

impl Completion {
    pub(crate) fn run(self, command: &mut clap::Command) -> anyhow::Result<()> {
        let mut script = Vec::new();
        generate(self.shell, command, "trainer", &mut script);
        print(&String::from_utf8(script)?)
    }
}
