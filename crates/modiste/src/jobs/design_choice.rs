//! What a garment is made from.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use modiste_body::{Body, Part};
use modiste_cloth::Fabric;
use modiste_cloth::dress::{Design, Mannequin, ReadyMade};
use modiste_cloth::pattern::{GradedPattern, known};
use modiste_core::{Progress, Vec3};
use modiste_io::obj;

use crate::JobError;
use crate::event::Reporter;

/// What a garment is made from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum DesignChoice {
    /// One of those that ship with the program, by name.
    BuiltIn(String),
    /// A pattern file: GarmentCode's specification, drawn for one body, or ours, with its sizes.
    File {
        /// The file.
        path: PathBuf,
        /// Name of the garment; otherwise that of the file.
        name: Option<String>,
        /// Name of the fabric; otherwise tops are of jersey, the rest of twill.
        fabric: Option<String>,
    },
    /// A sewn mesh as it lies on a body in the template pose.
    Mesh {
        /// The garment's OBJ file.
        path: PathBuf,
        /// The body's OBJ file, such as [`crate::BodyMake`] writes; otherwise it lies on the mean body.
        body: Option<PathBuf>,
        /// Name of the garment; otherwise that of the file.
        name: Option<String>,
        /// Name of the fabric; otherwise jersey.
        fabric: Option<String>,
    },
}

/// Fabric of a mesh that nobody names one for.
const MESH_FABRIC: &str = "jersey";

impl DesignChoice {
    /// What the garment is called.
    pub fn garment(&self) -> String {
        match self {
            Self::BuiltIn(name) => name.clone(),
            Self::File { name: Some(name), .. } | Self::Mesh { name: Some(name), .. } => name.clone(),
            Self::File { path, .. } | Self::Mesh { path, .. } => file_name(path),
        }
    }

    /// The design. A pattern without sizes is graded around `mean`, the mean body.
    pub(crate) fn load(&self, mean: &Body, reporter: &Reporter<'_>) -> Result<Design, JobError> {
        let gender = mean.model().gender();
        match self {
            Self::BuiltIn(name) => Ok(Arc::new(known(name, gender)?).into()),
            Self::File { path, fabric, .. } => {
                check_fabric(fabric.as_deref())?;
                Ok(self.pattern(path, fabric.as_deref(), mean, reporter)?.into())
            }
            Self::Mesh { path, body, fabric, .. } => {
                check_fabric(fabric.as_deref())?;
                let mannequin = Mannequin::from(mean);
                let (worn_on, metres) = match body {
                    Some(body) => worn_on(body, &mannequin, reporter)?,
                    None => (mannequin.clone(), 1.0),
                };
                let (mut vertices, faces) = obj::read(path)?;
                vertices.iter_mut().for_each(|x| *x *= metres);
                let garment = self.garment();
                let named = (garment.as_str(), gender, fabric.as_deref().unwrap_or(MESH_FABRIC));
                let mesh = ReadyMade::new(named, &vertices, &faces, &worn_on, &mannequin)?;
                Ok(Design::ReadyMade(Arc::new(mesh)))
            }
        }
    }

    fn pattern(
        &self,
        path: &Path,
        fabric: Option<&str>,
        mean: &Body,
        reporter: &Reporter<'_>,
    ) -> Result<Arc<GradedPattern>, JobError> {
        let gender = mean.model().gender();
        let name = path.display().to_string();
        let text = modiste_io::read_text(path)?;
        let spec = modiste_io::pattern::parse(text.as_bytes(), &name)?;
        if spec.other.contains_key("modiste") {
            let mut pattern = GradedPattern::from_json(&name, &text)?;
            if pattern.gender != gender.name() {
                return Err(JobError::Request(format!(
                    "{name} is cut for {} bodies, not for {} ones",
                    pattern.gender,
                    gender.name()
                )));
            }
            pattern.garment = self.garment();
            if let Some(fabric) = fabric {
                fabric.clone_into(&mut pattern.material);
            }
            return Ok(Arc::new(pattern));
        }
        let wearer = Mannequin::from(mean).wearer(gender);
        let (pattern, notes) = GradedPattern::from_ungraded(&spec, &name, &self.garment(), fabric, &wearer)?;
        for note in notes {
            reporter.warn(&format!("{name}: {note}"));
        }
        Ok(Arc::new(pattern))
    }
}

fn check_fabric(name: Option<&str>) -> Result<(), JobError> {
    if let Some(name) = name.filter(|name| Fabric::from_name(name).is_none()) {
        let known: Vec<String> = Fabric::all().into_iter().map(|fabric| fabric.name).collect();
        return Err(JobError::Request(format!("there is no fabric `{name}`; known: {}", known.join(", "))));
    }
    Ok(())
}

/// The body that a mesh lies on, and the metres in a unit of its file, which are those of the garment too.
fn worn_on(path: &Path, mean: &Mannequin, reporter: &Reporter<'_>) -> Result<(Mannequin, f64), JobError> {
    let (mut vertices, faces) = obj::read(path)?;
    let name = path.display();
    if faces != mean.topology.faces() {
        let (wanted, found) = (mean.topology.face_count(), faces.len());
        return Err(JobError::Request(format!(
            "{name}: wanted the {wanted} triangles of this project's bodies, found {found} others; `modiste body make` \
             writes such a body, to model the garment on"
        )));
    }
    let (low, high) = vertices.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x.y), h.max(x.y)));
    let height = high - low;
    let Some((unit, metres)) = UNITS.into_iter().find(|(_, metres)| (1.2..2.3).contains(&(metres * height))) else {
        let wanted = "wanted a body 1.2 to 2.3 m high, in metres, decimetres, centimetres, millimetres or inches";
        return Err(JobError::Request(format!("{name}: {wanted}, found {height}")));
    };
    if unit != UNITS[0].0 {
        reporter.warn(&format!("{name}: body and garment are taken to be in {unit}, as the body is {height:.1} high"));
    }
    vertices.iter_mut().for_each(|x| *x *= metres);
    let body = Mannequin { vertices, ..mean.clone() };
    for [upper, lower] in LIMBS {
        let angle = direction(&body, upper, lower).angle_between(direction(mean, upper, lower)).to_degrees();
        if angle > LARGEST_TURN {
            let lower = lower.name();
            return Err(JobError::Request(format!(
                "{name}: a body in the template pose was wanted, found its {lower} turned by {angle:.0} degrees"
            )));
        }
    }
    Ok((body, metres))
}

/// Units that files are in, the usual one first, and their length (m).
pub(super) const UNITS: [(&str, f64); 5] =
    [("metres", 1.0), ("decimetres", 0.1), ("centimetres", 0.01), ("millimetres", 0.001), ("inches", 0.0254)];

/// Neighbouring parts whose direction tells the pose.
const LIMBS: [[Part; 2]; 8] = [
    [Part::LeftUpperArm, Part::LeftForearm],
    [Part::RightUpperArm, Part::RightForearm],
    [Part::LeftForearm, Part::LeftHand],
    [Part::RightForearm, Part::RightHand],
    [Part::LeftThigh, Part::LeftShin],
    [Part::RightThigh, Part::RightShin],
    [Part::Pelvis, Part::Chest],
    [Part::Chest, Part::Head],
];

/// A limb may be turned by this against the mean body's (degrees): bodies differ in build.
const LARGEST_TURN: f64 = 20.0;

/// From the middle of one part to that of another.
fn direction(body: &Mannequin, from: Part, to: Part) -> Vec3 {
    let middle = |part: Part| {
        let of_part = || body.vertices.iter().zip(&body.vertex_parts).filter(move |(_, of)| **of == part);
        of_part().map(|(x, _)| *x).sum::<Vec3>() / of_part().count().max(1) as f64
    };
    middle(to) - middle(from)
}

/// The name of a file without its endings, and without what GarmentCode adds to it.
fn file_name(path: &Path) -> String {
    let name = path.file_name().and_then(|name| name.to_str()).unwrap_or("garment");
    let stem = name.split('.').next().unwrap_or(name);
    stem.strip_suffix("_specification").unwrap_or(stem).to_owned()
}

#[cfg(test)]
mod tests {
    use super::DesignChoice;

    #[test]
    fn garments_are_named_after_their_file() {
        let file = |path: &str| DesignChoice::File { path: path.into(), name: None, fabric: None }.garment();
        assert_eq!(file("a/skirt2_specification.json"), "skirt2");
        assert_eq!(file("cape.json"), "cape");
        let named = DesignChoice::File { path: "x.json".into(), name: Some("robe".into()), fabric: None };
        assert_eq!(named.garment(), "robe");
    }
}
