//! Findings of all frames together.

use serde::{Deserialize, Serialize};

use super::{Found, FrameCheck};

/// Schema of the report.
const SCHEMA: &str = "modiste-check-2";

/// Depths that are allowed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Limits {
    /// Of triangles in the body, and of an outer garment in an inner one (mm).
    pub crossing_mm: f64,
    /// Of a garment in itself (mm); what is deeper is told, and does not fail the check.
    pub itself_mm: f64,
}

impl Default for Limits {
    fn default() -> Self {
        Self { crossing_mm: 0.5, itself_mm: 2.0 }
    }
}

/// One kind of finding over all frames.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Finding {
    /// Vertices or pairs of triangles, summed over the frames.
    pub count: usize,
    /// The greatest depth (mm).
    pub worst_mm: f64,
    /// The frame that has it.
    pub worst_frame: Option<usize>,
    /// Where in that frame (m, world).
    pub worst_place: Option<[f64; 3]>,
    /// Frames with such findings: first and last of each run.
    pub frames: Vec<[usize; 2]>,
    /// Those with findings that are not allowed.
    pub too_deep: Vec<[usize; 2]>,
}

/// What was found of one garment.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct GarmentFindings {
    /// Its name.
    pub garment: String,
    /// Vertices inside the body; none is allowed.
    pub inside_body: Finding,
    /// Vertices pinched between parts of the body that are in each other.
    pub pinched: Finding,
    /// Pairs of a triangle of the garment and one of the body that cross, but for those that are caught.
    pub crossing_body: Finding,
    /// Such pairs where parts of the body are in each other. They are told, and do not fail the check.
    pub caught: Finding,
    /// Pairs of its own triangles that cross.
    pub crossing_itself: Finding,
}

/// What was found of two garments.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct LayerFindings {
    /// Name of the inner garment.
    pub inner: String,
    /// Name of the outer garment.
    pub outer: String,
    /// Vertices of the outer garment below the inner one.
    pub below: Finding,
    /// Pairs of their triangles that cross.
    pub crossing: Finding,
}

/// What was found in a dressed result.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CheckReport {
    /// Version of this form.
    pub schema: String,
    /// Number of frames.
    pub frames: usize,
    /// What is allowed.
    pub limits: Limits,
    /// Whether in every frame no vertex is inside the body, and nothing is deeper in the body or in an inner garment than is
    /// allowed, but where parts of the body are in each other.
    pub holds: bool,
    /// Vertices of the body inside another part of it: the frames to be wary of.
    pub body_in_itself: Finding,
    /// One for each garment, from the innermost outwards.
    pub garments: Vec<GarmentFindings>,
    /// One for each pair of garments.
    pub layers: Vec<LayerFindings>,
}

impl Finding {
    fn add(&mut self, frame: usize, found: Found, limit_mm: f64) {
        let depth_mm = 1e3 * found.depth;
        self.count += found.count;
        if found.count > 0 {
            extend(&mut self.frames, frame);
        }
        if depth_mm > limit_mm {
            extend(&mut self.too_deep, frame);
        }
        if depth_mm > self.worst_mm {
            (self.worst_mm, self.worst_frame) = (depth_mm, Some(frame));
            self.worst_place = found.place.map(|place| place.to_array());
        }
    }

    /// In how many frames there is such a finding.
    pub fn frame_count(&self) -> usize {
        self.frames.iter().map(|[first, last]| last - first + 1).sum()
    }
}

/// Adds a frame to runs of frames.
fn extend(runs: &mut Vec<[usize; 2]>, frame: usize) {
    match runs.last_mut() {
        Some(run) if run[1] + 1 == frame => run[1] = frame,
        _ => runs.push([frame, frame]),
    }
}

impl CheckReport {
    /// Before the first frame, for garments from the innermost outwards.
    pub fn new(garments: &[&str], limits: Limits) -> Self {
        let named = |name: &&str| GarmentFindings { garment: (*name).to_owned(), ..GarmentFindings::default() };
        let pairs = (0..garments.len()).flat_map(|inner| (inner + 1..garments.len()).map(move |outer| (inner, outer)));
        let pair = |(inner, outer): (usize, usize)| LayerFindings {
            inner: garments[inner].to_owned(),
            outer: garments[outer].to_owned(),
            ..LayerFindings::default()
        };
        Self {
            schema: SCHEMA.to_owned(),
            frames: 0,
            limits,
            holds: true,
            body_in_itself: Finding::default(),
            garments: garments.iter().map(named).collect(),
            layers: pairs.map(pair).collect(),
        }
    }

    /// Adds the next frame.
    pub fn add(&mut self, found: &FrameCheck) {
        let (frame, limits) = (self.frames, self.limits);
        self.frames += 1;
        self.body_in_itself.add(frame, found.body, f64::INFINITY);
        for (sum, garment) in self.garments.iter_mut().zip(&found.garments) {
            sum.inside_body.add(frame, garment.inside, 0.0);
            sum.pinched.add(frame, garment.pinched, f64::INFINITY);
            sum.crossing_body.add(frame, garment.body, limits.crossing_mm);
            sum.caught.add(frame, garment.caught, limits.crossing_mm);
            sum.crossing_itself.add(frame, garment.itself, limits.itself_mm);
            self.holds &= garment.inside.count == 0 && 1e3 * garment.body.depth <= limits.crossing_mm;
        }
        for (sum, layer) in self.layers.iter_mut().zip(&found.layers) {
            sum.below.add(frame, layer.below, limits.crossing_mm);
            sum.crossing.add(frame, layer.crossings, limits.crossing_mm);
            self.holds &= 1e3 * layer.below.depth.max(layer.crossings.depth) <= limits.crossing_mm;
        }
    }
}
