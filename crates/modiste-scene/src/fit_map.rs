//! Where clothes are tight and where they are loose: ease and strain of every vertex, and in numbers for each region.

use std::collections::BTreeMap;

use modiste_body::{Body, Part, Quantity};
use modiste_cloth::dress::{Design, FlatGarment, Mannequin, Tailor, TailorOptions};
use modiste_core::{Progress, Topology, TriangleBvh, Vec2, Vec3};
use modiste_garment::DrapeModel;
use serde::{Deserialize, Serialize};

use crate::{Animation, Person, SceneError};

/// Most frames that the map is the mean of.
const MOST_FRAMES: usize = 60;
/// Half the height of the bands around chest, waist and hip (m).
const BAND: f64 = 0.07;

/// Median strain (%) above which a region is tight, and medians of the distance (mm) up to which it is close and from which it
/// is loose: about where cloth pulls in wear, and 6 and 19 cm of girth.
const TIGHT_PERCENT: f64 = 3.0;
const CLOSE_MM: f64 = 10.0;
const LOOSE_MM: f64 = 30.0;

/// A part of the body on which fit is judged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[expect(missing_docs, reason = "the names say it")]
pub enum Region {
    Chest,
    Waist,
    Hip,
    Thigh,
    UpperArm,
}

/// How a garment sits, in a word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Half of the cloth is stretched by more than 3 %.
    Tight,
    /// Half of it lies less than 10 mm from the body, hardly stretched.
    Close,
    /// From 10 to 30 mm.
    Easy,
    /// More than 30 mm.
    Loose,
}

/// How a garment sits on one region.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RegionFit {
    /// The garment.
    pub garment: String,
    /// Size of the pattern that was chosen for the body.
    pub size: String,
    /// Where.
    pub region: Region,
    /// Number of vertices there.
    pub vertices: usize,
    /// Median distance of the cloth from the body (mm).
    pub ease_mm: f64,
    /// Distance (mm) that 5 % of the vertices fall below.
    pub ease_5_percent_mm: f64,
    /// Median of the larger principal stretch of the cloth against its pattern, less one (%).
    pub strain_percent: f64,
    /// Strain (%) that 5 % of the vertices exceed.
    pub strain_95_percent: f64,
    /// In a word.
    pub verdict: Verdict,
}

/// Ease and strain of one garment.
#[derive(Debug, Clone, PartialEq)]
pub struct GarmentMap {
    /// The garment.
    pub garment: String,
    /// Size of the pattern.
    pub size: String,
    /// Distance of each vertex from the body (mm).
    pub ease_mm: Vec<f64>,
    /// Larger principal stretch around each vertex against the pattern, less one (%).
    pub strain_percent: Vec<f64>,
    /// Region of each vertex, if it lies on one.
    pub regions: Vec<Option<Region>>,
}

/// Ease and strain of all garments of a person, the mean over a motion.
#[derive(Debug, Clone, PartialEq)]
pub struct FitMap {
    /// From the innermost garment outwards.
    pub garments: Vec<GarmentMap>,
}

impl FitMap {
    /// Measures the garments of an animated person against their patterns, over at most sixty frames spread evenly.
    ///
    /// # Errors
    /// A garment that has no pattern in its file or was learned at another fineness than it is cut at, a body that cannot be
    /// measured, or frames that cannot be read.
    pub fn of(person: &Person, animation: &Animation, progress: &dyn Progress) -> Result<Self, SceneError> {
        const STAGE: &str = "map the fit";
        let body = person.body();
        let mannequin = Mannequin::from(body);
        let flats = person.garments().iter().map(|model| lay_flat(model, &mannequin)).collect::<Result<Vec<_>, _>>()?;
        let regions = body_regions(body)?;
        let topology = body.model().topology();
        let mut tree = TriangleBvh::new(topology, body.rest_vertices());
        let mut maps: Vec<GarmentMap> =
            flats.iter().zip(person.garments()).map(|(flat, model)| empty(flat, model)).collect();
        let count = animation.frame_count().min(MOST_FRAMES);
        progress.start(STAGE, count);
        for index in 0..count {
            let frame = index * animation.frame_count() / count;
            let skin = animation.tracks[0].points(frame)?;
            tree.refit(&skin);
            for ((map, flat), track) in maps.iter_mut().zip(&flats).zip(&animation.tracks[1..]) {
                let cloth = track.points(frame)?;
                for (vertex, &point) in cloth.iter().enumerate() {
                    let Some(at) = tree.closest_point(&skin, point, f64::INFINITY) else { continue };
                    map.ease_mm[vertex] += 1e3 * at.distance / count as f64;
                    if index == 0 {
                        map.regions[vertex] = regions[topology.faces()[at.face as usize][0] as usize];
                    }
                }
                for (sum, strain) in
                    map.strain_percent.iter_mut().zip(vertex_strains(&flat.topology, &flat.rest_faces, &cloth))
                {
                    *sum += 100.0 * strain / count as f64;
                }
            }
            progress.advance(STAGE, index + 1);
        }
        progress.finish(STAGE);
        Ok(Self { garments: maps })
    }

    /// The numbers for each garment and region.
    pub fn regions(&self) -> Vec<RegionFit> {
        let mut found = Vec::new();
        for map in &self.garments {
            let mut members: BTreeMap<Region, Vec<usize>> = BTreeMap::new();
            for (vertex, region) in map.regions.iter().enumerate() {
                if let Some(region) = region {
                    members.entry(*region).or_default().push(vertex);
                }
            }
            found.extend(members.into_iter().map(|(region, members)| map.region(region, &members)));
        }
        found
    }
}

impl GarmentMap {
    fn region(&self, region: Region, members: &[usize]) -> RegionFit {
        let sorted = |values: &[f64]| {
            let mut sorted: Vec<f64> = members.iter().map(|&vertex| values[vertex]).collect();
            sorted.sort_by(f64::total_cmp);
            sorted
        };
        let (ease, strain) = (sorted(&self.ease_mm), sorted(&self.strain_percent));
        let (ease_mm, strain_percent) = (ease[ease.len() / 2], strain[strain.len() / 2]);
        let verdict = if strain_percent > TIGHT_PERCENT {
            Verdict::Tight
        } else if ease_mm < CLOSE_MM {
            Verdict::Close
        } else if ease_mm <= LOOSE_MM {
            Verdict::Easy
        } else {
            Verdict::Loose
        };
        RegionFit {
            garment: self.garment.clone(),
            size: self.size.clone(),
            region,
            vertices: members.len(),
            ease_mm,
            ease_5_percent_mm: ease[(ease.len() - 1) / 20],
            strain_percent,
            strain_95_percent: strain[(strain.len() - 1) * 19 / 20],
            verdict,
        }
    }
}

/// The flat panels of a learned garment in the size for a body.
fn lay_flat(model: &DrapeModel, mannequin: &Mannequin) -> Result<FlatGarment, SceneError> {
    let garment = model.garment();
    let refused = |reason: String| SceneError::NoPattern { garment: garment.name.clone(), reason };
    if garment.pattern.is_empty() {
        return Err(refused("its file holds none".to_owned()));
    }
    let design =
        Design::from_json(&garment.name, &garment.pattern, mannequin).map_err(|error| refused(error.to_string()))?;
    // Garments are learned at the usual fineness, or at one that their number of vertices tells.
    for vertex_count in [TailorOptions::default().vertex_count, garment.template.len()] {
        let options = TailorOptions { vertex_count, ..TailorOptions::default() };
        let tailor = Tailor::new(design.clone(), options).map_err(|error| refused(error.to_string()))?;
        if tailor.topology().faces() == garment.topology.faces() {
            return Ok(tailor.flat(mannequin));
        }
    }
    Err(refused(format!("it was learned at {} vertices, and its pattern is cut at others", garment.template.len())))
}

fn empty(flat: &FlatGarment, model: &DrapeModel) -> GarmentMap {
    let count = flat.topology.vertex_count();
    GarmentMap {
        garment: model.garment().name.clone(),
        size: flat.size.clone(),
        ease_mm: vec![0.0; count],
        strain_percent: vec![0.0; count],
        regions: vec![None; count],
    }
}

/// The region of each vertex of a body, by part, and on the trunk by height in the template pose.
fn body_regions(body: &Body) -> Result<Vec<Option<Region>>, SceneError> {
    let measured = body.measurements()?;
    let floor = body.rest_vertices().iter().map(|vertex| vertex.y).fold(f64::INFINITY, f64::min);
    let levels = [
        (Region::Chest, measured.get(Quantity::BustHeight)),
        (Region::Waist, measured.get(Quantity::WaistHeight)),
        (Region::Hip, measured.get(Quantity::HipHeight)),
    ];
    let level_of = |height: f64| {
        let near = levels.iter().filter(|(_, level)| (height - level).abs() <= BAND);
        near.min_by(|a, b| (height - a.1).abs().total_cmp(&(height - b.1).abs())).map(|(region, _)| *region)
    };
    let region = |(part, vertex): (&Part, &Vec3)| match part {
        Part::LeftUpperArm | Part::RightUpperArm => Some(Region::UpperArm),
        Part::LeftThigh | Part::RightThigh => level_of(vertex.y - floor).or(Some(Region::Thigh)),
        Part::Pelvis | Part::Abdomen | Part::Chest => level_of(vertex.y - floor),
        _ => None,
    };
    Ok(body.model().vertex_parts().iter().zip(body.rest_vertices()).map(region).collect())
}

/// The larger principal stretch of each face less one, averaged over the faces around each vertex by their area at rest.
fn vertex_strains(topology: &Topology, rest_faces: &[[Vec2; 3]], x: &[Vec3]) -> Vec<f64> {
    let (mut sums, mut weights) = (vec![0.0; x.len()], vec![0.0; x.len()]);
    for (face, rest) in topology.faces().iter().zip(rest_faces) {
        let area = 0.5 * (rest[1] - rest[0]).perp_dot(rest[2] - rest[0]).abs();
        let strain = principal_stretch(*rest, face.map(|vertex| x[vertex as usize])) - 1.0;
        for &vertex in face {
            sums[vertex as usize] += area * strain;
            weights[vertex as usize] += area;
        }
    }
    sums.iter().zip(&weights).map(|(sum, weight)| if *weight > 0.0 { sum / weight } else { 0.0 }).collect()
}

/// The larger singular value of the map from a flat triangle to one in space; 1 for a flat triangle without area.
fn principal_stretch(rest: [Vec2; 3], x: [Vec3; 3]) -> f64 {
    let (u, v) = (rest[1] - rest[0], rest[2] - rest[0]);
    let determinant = u.perp_dot(v);
    if determinant == 0.0 {
        return 1.0;
    }
    let (p, q) = (x[1] - x[0], x[2] - x[0]);
    // Columns of F = [p q] [u v]⁻¹.
    let along = (p * v.y - q * u.y) / determinant;
    let across = (q * u.x - p * v.x) / determinant;
    let (a, b, c) = (along.length_squared(), along.dot(across), across.length_squared());
    let half_sum = 0.5 * (a + c);
    (half_sum + (0.25 * (a - c) * (a - c) + b * b).sqrt()).sqrt()
}

#[cfg(test)]
mod tests {
    use super::{GarmentMap, Region, Verdict, principal_stretch, vertex_strains};
    use modiste_core::{Topology, Vec2, Vec3, rotation_from_vector};

    #[test]
    fn the_stretch_of_a_sheet_is_found_whichever_way_it_lies() {
        let rest = [Vec2::new(0.1, 0.2), Vec2::new(0.5, 0.3), Vec2::new(0.2, 0.7)];
        let turn = rotation_from_vector(Vec3::new(0.4, -1.0, 2.0));
        for (wide, high, wanted) in [(1.0, 1.0, 1.0), (1.2, 0.9, 1.2), (0.7, 1.05, 1.05), (0.5, 0.5, 0.5)] {
            let x = rest.map(|p| turn * Vec3::new(wide * p.x, high * p.y, 0.3));
            assert!((principal_stretch(rest, x) - wanted).abs() < 1e-12);
        }
        // A simple shear by s: the larger stretch is s/2 + sqrt(1 + s²/4).
        let sheared = rest.map(|p| turn * Vec3::new(p.x + 0.5 * p.y, p.y, 0.0));
        assert!((principal_stretch(rest, sheared) - (0.25 + 1.0625f64.sqrt())).abs() < 1e-12);
        assert!((principal_stretch([Vec2::ZERO; 3], [Vec3::ZERO; 3]) - 1.0).abs() < 1e-15);
    }

    #[test]
    fn a_vertex_takes_the_mean_of_its_faces_by_area() {
        let topology = Topology::new(4, vec![[0, 1, 2], [0, 2, 3]]).unwrap();
        let rest = [[Vec2::ZERO, Vec2::X, Vec2::ONE], [Vec2::ZERO, Vec2::ONE, Vec2::Y]];
        let x = [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::new(0.0, 1.0, 0.0)];
        assert!(vertex_strains(&topology, &rest, &x).iter().all(|strain| strain.abs() < 1e-12));
        let wide = x.map(|p| Vec3::new(1.1 * p.x, p.y, p.z));
        assert!(vertex_strains(&topology, &rest, &wide).iter().all(|strain| (strain - 0.1).abs() < 1e-12));
    }

    #[test]
    fn regions_are_summed_up_and_named() {
        let map = |ease: f64, strain: f64| GarmentMap {
            garment: "a".into(),
            size: "M".into(),
            ease_mm: (0..101).map(|i| ease + f64::from(i) / 50.0 - 1.0).collect(),
            strain_percent: vec![strain; 101],
            regions: vec![Some(Region::Hip); 101],
        };
        let fit = |ease, strain| {
            let found = super::FitMap { garments: vec![map(ease, strain)] }.regions();
            assert_eq!(found.len(), 1);
            found[0].clone()
        };
        let found = fit(20.0, 1.0);
        assert!((found.ease_mm - 20.0).abs() < 1e-9 && (found.ease_5_percent_mm - 19.1).abs() < 1e-9, "{found:?}");
        assert_eq!((found.region, found.vertices, found.verdict), (Region::Hip, 101, Verdict::Easy));
        assert_eq!(fit(5.0, 1.0).verdict, Verdict::Close);
        assert_eq!(fit(45.0, 1.0).verdict, Verdict::Loose);
        assert_eq!(fit(5.0, 4.0).verdict, Verdict::Tight);
    }
}
