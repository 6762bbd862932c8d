//! Checking a dressed result: what is inside the body, what crosses what, and how deep.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use modiste_core::{Progress, Topology, Vec3};
use modiste_garment::check::{CheckReport, Checker, Limits};
use modiste_io::IoError;
use modiste_io::dressed::{self, BODY, Contents};
use modiste_scene::file_names;
use rayon::prelude::*;
use serde::Serialize;

use crate::JobError;
use crate::event::Reporter;

/// Frames that are held and checked at once, for each thread.
const FRAMES_PER_THREAD: usize = 4;

/// Checks a dressed result, ours or another program's: an npz with `body` (F, V, 3), `body_faces`, and the same for each
/// garment.
///
/// Garments are layered as the report beside the file says, otherwise in the order of the file, the innermost first.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Check {
    /// The npz file.
    pub file: PathBuf,
}

/// What checking gives back.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Checked {
    /// The npz file.
    pub file: PathBuf,
    /// What was found.
    pub report: CheckReport,
}

impl Check {
    pub(crate) fn run(&self, reporter: &Reporter<'_>) -> Result<Checked, JobError> {
        let contents = dressed::read_contents(&self.file)?;
        let order = layers(&contents, &self.file, reporter);
        let names: Vec<&str> = order[1..].iter().map(|&mesh| contents.meshes[mesh].name.as_str()).collect();
        let mut checking = Checking {
            topologies: topologies(&contents, &order, &self.file)?,
            checker: None,
            waiting: Vec::new(),
            report: CheckReport::new(&names, Limits::default()),
            reporter,
        };
        const STAGE: &str = Checking::STAGE;
        reporter.start(STAGE, contents.frame_count);
        dressed::for_each_frame(&self.file, &contents, |_, meshes| {
            let points = |mesh: &[[f32; 3]]| mesh.iter().map(|&p| Vec3::from_array(p.map(f64::from))).collect();
            checking.add(order.iter().map(|&mesh| points(meshes[mesh])).collect());
            Ok::<(), IoError>(())
        })?;
        checking.work();
        reporter.finish(STAGE);
        Ok(Checked { file: self.file.clone(), report: checking.report })
    }
}

/// A check on its way: frames wait until there are enough for all threads.
struct Checking<'a> {
    topologies: Vec<Arc<Topology>>,
    checker: Option<Checker>,
    waiting: Vec<Vec<Vec<Vec3>>>,
    report: CheckReport,
    reporter: &'a Reporter<'a>,
}

impl Checking<'_> {
    const STAGE: &'static str = "check";

    fn add(&mut self, frame: Vec<Vec<Vec3>>) {
        self.waiting.push(frame);
        if self.waiting.len() >= FRAMES_PER_THREAD * rayon::current_num_threads() {
            self.work();
        }
    }

    fn work(&mut self) {
        let Some(first) = self.waiting.first() else { return };
        let topologies = &self.topologies;
        let checker = self.checker.get_or_insert_with(|| {
            let meshes: Vec<_> = topologies.iter().cloned().zip(first.iter().map(Vec::as_slice)).collect();
            Checker::new(&meshes)
        });
        let found: Vec<_> = self.waiting.par_iter().with_max_len(1).map(|frame| checker.check(frame)).collect();
        for frame in &found {
            self.report.add(frame);
        }
        self.waiting.clear();
        self.reporter.advance(Self::STAGE, self.report.frames);
    }
}

fn topologies(contents: &Contents, order: &[usize], file: &Path) -> Result<Vec<Arc<Topology>>, JobError> {
    let topology = |&mesh: &usize| {
        let mesh = &contents.meshes[mesh];
        let made = Topology::new(mesh.vertex_count, mesh.faces.clone());
        let field = format!("array \"{}_faces\"", mesh.name);
        made.map(Arc::new).map_err(|error| {
            IoError::field(&file.display().to_string(), field, "the triangles of a mesh", error).into()
        })
    };
    order.iter().map(topology).collect()
}

/// The meshes with the body first, then the garments from the innermost outwards.
fn layers(contents: &Contents, file: &Path, reporter: &Reporter<'_>) -> Vec<usize> {
    let index = |name: &str| contents.meshes.iter().position(|mesh| mesh.name == name);
    let body = index(BODY);
    let garments: Vec<usize> = (0..contents.meshes.len()).filter(|&mesh| Some(mesh) != body).collect();
    let report = file.with_file_name(file_names::REPORT);
    let told = modiste_io::exists(&report).then(|| garments_of_report(&report)).flatten();
    let mut ordered = garments.clone();
    if let Some(names) = told {
        let named: Vec<usize> = names.iter().filter_map(|name| index(name)).collect();
        let mut sorted = named.clone();
        sorted.sort_unstable();
        if sorted == garments {
            ordered = named;
        } else {
            reporter.warn(&format!(
                "{} speaks of other garments than {}: they are layered in the order of the file",
                report.display(),
                file.display()
            ));
        }
    }
    body.into_iter().chain(ordered).collect()
}

/// The garments from the innermost outwards, if the file is such a report.
fn garments_of_report(report: &Path) -> Option<Vec<String>> {
    let report: serde_json::Value = modiste_io::json::read(report).ok()?;
    serde_json::from_value(report["subject"]["garments"].clone()).ok()
}
