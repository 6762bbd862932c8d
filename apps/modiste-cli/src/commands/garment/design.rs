//! The words for what a garment is made from.

use std::path::PathBuf;

use clap::Args;
use modiste::DesignChoice;

/// Which garment.
#[derive(Debug, Args)]
pub(crate) struct DesignArguments {
    /// A built-in pattern: `tshirt`, `longsleeve`, `shorts`, `pants` or `skirt`.
    #[arg(
        value_name = "GARMENT",
        required_unless_present_any = ["pattern", "mesh"],
        conflicts_with_all = ["pattern", "mesh", "body", "name", "fabric"]
    )]
    garment: Option<String>,
    /// A pattern file: GarmentCode's specification, or ours with its sizes.
    #[arg(long, value_name = "FILE", conflicts_with = "mesh")]
    pattern: Option<PathBuf>,
    /// A sewn garment without a pattern: an OBJ mesh, as it lies on a body in the template pose.
    #[arg(long, value_name = "FILE")]
    mesh: Option<PathBuf>,
    /// The body that the mesh lies on, as `modiste body make` writes it; otherwise the mean body.
    #[arg(long, value_name = "FILE", requires = "mesh")]
    body: Option<PathBuf>,
    /// What the garment is called; otherwise like the file.
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
    /// Its fabric; otherwise jersey for tops and meshes, twill for the rest.
    #[arg(long, value_name = "NAME")]
    fabric: Option<String>,
}

impl DesignArguments {
    pub(crate) fn choice(&self) -> DesignChoice {
        let (name, fabric) = (self.name.clone(), self.fabric.clone());
        match (&self.pattern, &self.mesh) {
            (Some(path), _) => DesignChoice::File { path: path.clone(), name, fabric },
            (_, Some(path)) => DesignChoice::Mesh { path: path.clone(), body: self.body.clone(), name, fabric },
            _ => DesignChoice::BuiltIn(self.garment.clone().unwrap_or_default()),
        }
    }
}
