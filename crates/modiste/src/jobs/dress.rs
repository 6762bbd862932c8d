//! Dressing a moving body: the main job.

use std::path::PathBuf;

use modiste_body::{Gender, ScapeModel};
use modiste_core::Progress;
use modiste_garment::DrapeModel;
use modiste_garment::refine::FitOptions;
use modiste_io::StagedFolder;
use modiste_scene::{Contents, FitMap, Format, Person, Report, Subject, write_results};
use serde::Serialize;
use std::sync::Arc;

use crate::event::Reporter;
use crate::limits::check_range;
use crate::{Assets, BodyChoice, HairChoice, JobError, Length, MotionChoice};

/// Dresses a moving body and writes scene, arrays, pictures and report into a folder.
#[derive(Debug, Clone, PartialEq)]
pub struct Dress {
    /// Whose body model and garments.
    pub gender: Gender,
    /// Which body.
    pub body: BodyChoice,
    /// What they do.
    pub motion: MotionChoice,
    /// What they wear: names of models in the assets, or files. After a colon a garment may have an ease of its own, as in
    /// `tshirt:0.5`.
    pub garments: Vec<String>,
    /// Their hair, if any.
    pub hair: Option<HairChoice>,
    /// How all others are cut: from slim, -1, over regular, 0, to loose, 1.
    pub ease: f64,
    /// How much of the motion; all of a file or four seconds of an action when absent.
    pub length: Option<Length>,
    /// The forms in which the animation is written.
    pub formats: Vec<Format>,
    /// Whether ease and strain are mapped.
    pub fit_map: bool,
    /// Whether triangles that cross skin or a garment below between their corners are parted, in up to twice the time.
    pub careful: bool,
    /// The folder for the results. Files of the same names in it are replaced.
    pub out: PathBuf,
}

/// What dressing gives back.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Dressed {
    /// What `report.json` says.
    pub report: Report,
    /// The files.
    pub files: Vec<PathBuf>,
}

impl Default for Dress {
    /// A woman of average shape walks in T-shirt and shorts.
    fn default() -> Self {
        Self {
            gender: Gender::Female,
            body: BodyChoice::Average,
            motion: MotionChoice::Action(super::Action::Walk),
            garments: vec!["tshirt".to_owned(), "shorts".to_owned()],
            hair: None,
            ease: 0.0,
            length: None,
            formats: Format::DEFAULT.to_vec(),
            fit_map: false,
            careful: false,
            out: PathBuf::from("out/dress"),
        }
    }
}

impl Dress {
    pub(crate) fn run(&self, reporter: &Reporter<'_>) -> Result<Dressed, JobError> {
        self.body.check()?;
        if let Some(Length::Seconds(_)) = self.length {
            // Frames are checked once the rate is known.
            self.length.map_or(Ok(()), |length| length.check(30.0))?;
        }
        let assets = Assets::find()?;
        let garment_files = self
            .garments
            .iter()
            .map(|garment| {
                let (name, ease) = with_ease(garment, self.ease)?;
                Ok((assets.garment(self.gender, name)?, ease))
            })
            .collect::<Result<Vec<_>, JobError>>()?;
        let hair_file = self.hair.as_ref().map(|hair| hair.file(&assets)).transpose()?;
        let folder = StagedFolder::new(&self.out)?;
        let steps = 2 + garment_files.len();
        reporter.start("load", steps);
        let model = ScapeModel::load(assets.body(self.gender))?;
        reporter.advance("load", 1);
        let mut garments = Vec::new();
        for (file, ease) in &garment_files {
            garments.push(Arc::new(DrapeModel::load(file)?.with_ease(*ease)?));
            reporter.advance("load", 1 + garments.len());
        }
        let body = self.body.make(&model, reporter)?;
        reporter.finish("load");
        let mut person = Person::new(body, garments)?;
        if let (Some(hair), Some(file)) = (&self.hair, &hair_file) {
            person = person.with_hair(hair.load(file)?);
        }
        let motion = self.motion.motion(person.body(), self.length, person.fps(), reporter)?;
        let options = if self.careful { FitOptions::careful() } else { FitOptions::default() };
        let animation = person.animate_on_disk(&motion, &options, folder.path(), reporter)?;
        let fit_map = self.fit_map.then(|| FitMap::of(&person, &animation, reporter)).transpose()?;
        let subject = Subject {
            gender: self.gender.name().to_owned(),
            shape: person.body().shape().to_vec(),
            motion: self.motion.name(),
            garments: person.garments().iter().map(|model| model.garment().name.clone()).collect(),
        };
        let warnings = reporter.warnings();
        let contents = Contents { subject, warnings, formats: &self.formats, fit_map: fit_map.as_ref() };
        reporter.start("write", 1);
        let (report, files) = write_results(&animation, contents, folder, reporter)?;
        reporter.finish("write");
        for file in &files {
            reporter.wrote(file);
        }
        Ok(Dressed { report, files })
    }
}

/// The name of a garment and its ease, which may be said after a colon.
fn with_ease(garment: &str, usual: f64) -> Result<(&str, f64), JobError> {
    let (name, ease) = match garment.rsplit_once(':') {
        Some((name, ease)) => {
            let wanted = || JobError::Request(format!("ease of {name}: a number was wanted, found `{ease}`"));
            (name, ease.parse::<f64>().ok().ok_or_else(wanted)?)
        }
        None => (garment, usual),
    };
    check_range(&format!("ease of {name}"), ease, (-1.0, 1.0), "(slim to loose)")?;
    Ok((name, ease))
}

#[cfg(test)]
mod tests {
    use super::with_ease;

    #[test]
    fn an_ease_may_follow_the_name() {
        assert_eq!(with_ease("tshirt", 0.5).unwrap(), ("tshirt", 0.5));
        assert_eq!(with_ease("a/b.safetensors:-0.25", 0.5).unwrap(), ("a/b.safetensors", -0.25));
        let refusal = |garment: &str, usual| with_ease(garment, usual).unwrap_err().to_string();
        assert_eq!(refusal("skirt:wide", 0.0), "ease of skirt: a number was wanted, found `wide`");
        assert_eq!(refusal("skirt", 3.0), "ease of skirt: wanted -1 to 1 (slim to loose), found 3");
        assert!(with_ease("skirt:NaN", 0.0).is_err());
    }
}
