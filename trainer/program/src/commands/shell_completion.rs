//! `trainer completion`

use clap::Args;
use clap_complete::{Shell, generate};

use super::print;

/// Print a completion script of this program's commands and options for a shell.
///
/// Example: trainer completion bash > ~/.local/share/bash-completion/completions/trainer
///          trainer completion zsh > ~/.zfunc/_trainer
///          trainer completion fish > ~/.config/fish/completions/trainer.fish
#[derive(Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct ShellCompletion {
    /// Name of the shell
    #[arg(value_enum)]
    shell: Shell,
}

impl ShellCompletion {
    pub(crate) fn run(self, command: &mut clap::Command) -> anyhow::Result<()> {
        let mut script = Vec::new();
        generate(self.shell, command, "trainer", &mut script);
        print(&String::from_utf8(script)?)
    }
}
