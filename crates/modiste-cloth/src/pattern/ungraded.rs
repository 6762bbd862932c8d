//! Patterns drawn for one body, as GarmentCode writes them: what their panels cover is read off their place in space, and
//! sizes are graded around the one that is there.

use modiste_body::{Gender, Part};
use modiste_core::{Quat, Vec2, Vec3};
use modiste_io::pattern::PatternSpec;

use super::curve::relative_from_absolute;
use super::json::curve_from;
use super::{Anchors, Curve, EdgeId, FitRule, Girths, GradedPattern, LowerPart, Outline, Panel, PatternError, Size};
use super::{Stitch, Wrap};

/// Steps between sizes on the leading girth (m), and how many there are to each side of the one that was drawn.
const STEP: f64 = 0.04;
const SIZES_EACH_WAY: usize = 8;

/// How lengths, and the width of sleeves, grow relative to the girth.
const LENGTH_GRADE: f64 = 0.12;
const SLEEVE_GRADE: f64 = 0.42;

/// ANSUR II: by how much the other girths change with the leading one (chest for tops, hip for the rest).
const UPPER_SLOPES: [f64; 3] = [1.0, 1.07, 0.71];
const LOWER_SLOPES: [f64; 3] = [0.88, 1.17, 1.0];

/// A panel of the trunk that is lower than this (m) is a waist band where there are legs or a skirt below it.
const BAND_HEIGHT: f64 = 0.15;

/// Two edges of a seam may differ by this factor: the longer one is gathered.
const MOST_GATHERED: f64 = 3.0;

/// Least and greatest height (m) that a garment has.
const HEIGHTS: [f64; 2] = [0.12, 2.2];

/// Height of the natural waist, where GarmentCode puts the upper edge of a band, over stature.
const NATURAL_WAIST: f64 = 0.63;

/// Trouser legs end at least this far above the floor (m); longer ones are shortened, or they catch on the feet.
const FLOOR_CLEARANCE: f64 = 0.055;

/// Number of anchors.
const ANCHORS: usize = 20;

/// The body that an ungraded pattern is taken to be drawn for. Heights are over the floor (m).
#[derive(Debug, Clone, Copy)]
pub struct Wearer {
    /// Whose body.
    pub gender: Gender,
    /// Its girths.
    pub girths: Girths,
    /// Where the shoulder seams of a top are placed.
    pub shoulder: f64,
    /// Its stature.
    pub stature: f64,
    /// Where the crotch line of trousers is placed.
    pub crotch: f64,
    /// The knee.
    pub knee: f64,
    /// Length of the upper arm.
    pub upper_arm: f64,
}

/// What a panel covers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Cover {
    Torso,
    /// A waist band above a skirt or trousers.
    Band,
    Hip,
    Leg {
        is_left: bool,
    },
    Arm {
        is_left: bool,
    },
}

/// A panel as it stands in space.
struct Sheet {
    name: String,
    cover: Cover,
    is_front: bool,
    labels: Vec<String>,
    /// Corners as drawn (m), and in space.
    drawn: Vec<Vec2>,
    placed: Vec<Vec3>,
    curves: Vec<Curve>,
    turn: Quat,
    /// The loop was walked the wrong way round: edge `i` is now edge `n − 1 − i`.
    is_reversed: bool,
}

impl GradedPattern {
    /// Takes a plain GarmentCode pattern as drawn for `wearer`, and grades it to other sizes: widths grow with the girth,
    /// lengths a little. `material` is the fabric; without it tops are of jersey, the rest of twill. Also says what had to be
    /// changed.
    ///
    /// # Errors
    /// [`PatternError`] naming the panel or seam: no size that a garment has, panels that cross themselves, seams that cannot
    /// be closed.
    pub fn from_ungraded(
        spec: &PatternSpec,
        name: &str,
        garment: &str,
        material: Option<&str>,
        wearer: &Wearer,
    ) -> Result<(Self, Vec<String>), PatternError> {
        let mut sheets = sheets(spec);
        let height = extent(sheets.iter().flat_map(|sheet| &sheet.placed).map(|p| p.y));
        let height = height.1 - height.0;
        if !(HEIGHTS[0]..=HEIGHTS[1]).contains(&height) {
            return Err(PatternError::Field {
                name: name.to_owned(),
                field: "properties.units_in_meter".to_owned(),
                wanted: format!("a unit in which the garment is {} to {} m tall", HEIGHTS[0], HEIGHTS[1]),
                found: format!("{} for {height:.3} m", spec.properties.units_in_meter),
            });
        }
        let mut flat = lay_flat(&mut sheets, wearer);
        let shortened = shorten_legs(&sheets, &mut flat, wearer);
        let is_upper = sheets.iter().any(|sheet| matches!(sheet.cover, Cover::Torso));
        let (sizes, scales) = sizes(wearer, is_upper);
        let panels: Vec<Panel> =
            sheets.iter().zip(&flat).map(|(sheet, corners)| panel(sheet, corners, &scales, wearer)).collect();
        let edge = |panel: &str, edge: usize| {
            let panel = sheets.iter().position(|sheet| sheet.name == panel).unwrap_or(0);
            let last = sheets[panel].labels.len() - 1;
            EdgeId { panel, edge: if sheets[panel].is_reversed { last - edge } else { edge } }
        };
        let seams = &spec.pattern.stitches;
        let stitches: Vec<Stitch> =
            seams.iter().map(|s| Stitch { sides: [0, 1].map(|k| edge(&s.sides[k].panel, s.sides[k].edge)) }).collect();
        let mut pattern = Self {
            garment: garment.to_owned(),
            gender: wearer.gender.name().to_owned(),
            material: material.unwrap_or(if is_upper { "jersey" } else { "twill" }).to_owned(),
            sizes,
            template_size: SIZES_EACH_WAY,
            fit: if is_upper { FitRule::Upper } else { FitRule::Lower },
            gather: MOST_GATHERED,
            band: NATURAL_WAIST,
            self_contact: true,
            panels,
            stitches,
            waist_band: Vec::new(),
            ribs: Vec::new(),
            anchors: Vec::new(),
        };
        pattern.check().map_err(|source| PatternError::Fault { name: name.to_owned(), source })?;
        let top = top_edges(&pattern);
        if !is_upper {
            pattern.waist_band.clone_from(&top);
        }
        let shoulders = if is_upper { shoulder_edges(&pattern) } else { Vec::new() };
        let anchored = if shoulders.is_empty() { top } else { shoulders };
        if anchored.is_empty() {
            return Err(PatternError::Field {
                name: name.to_owned(),
                field: "pattern.stitches".to_owned(),
                wanted: "shoulder seams, or an open edge at the top that the garment hangs by".to_owned(),
                found: "neither".to_owned(),
            });
        }
        let count = ANCHORS.div_ceil(anchored.len());
        pattern.anchors = anchored.into_iter().map(|edge| Anchors { edge, count }).collect();
        let notes = if shortened > 0.0 {
            vec![format!("the legs are {:.0} mm shorter than drawn, to clear the floor", 1e3 * shortened)]
        } else {
            Vec::new()
        };
        Ok((pattern, notes))
    }
}

fn extent(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
}

/// The panels in space, and what each covers.
fn sheets(spec: &PatternSpec) -> Vec<Sheet> {
    let units = spec.properties.units_in_meter;
    let is_absolute = spec.properties.curvature_coords == "absolute";
    let mut sheets: Vec<Sheet> = Vec::new();
    for (name, panel) in &spec.pattern.panels {
        let drawn: Vec<Vec2> =
            panel.edges.iter().map(|edge| Vec2::from_array(panel.vertices[edge.endpoints[0]]) / units).collect();
        let curve = |(index, edge): (usize, &modiste_io::pattern::Edge)| {
            let curve = curve_from(edge.curvature.as_ref(), units);
            let (start, end) = (drawn[index], drawn[(index + 1) % drawn.len()]);
            if is_absolute { relative_curve(curve, start, end, units) } else { curve }
        };
        let curves = panel.edges.iter().enumerate().map(curve).collect();
        let [x, y, z] = panel.rotation.map(f64::to_radians);
        let turn = Quat::from_rotation_z(z) * Quat::from_rotation_y(y) * Quat::from_rotation_x(x);
        let shift = Vec3::from_array(panel.translation) / units;
        let placed: Vec<Vec3> = drawn.iter().map(|p| turn * p.extend(0.0) + shift).collect();
        sheets.push(Sheet {
            name: name.clone(),
            cover: cover(panel.label.as_deref(), &placed, panel.rotation[2]),
            is_front: middle(&placed).z >= 0.0,
            labels: panel.edges.iter().map(|edge| edge.label.clone().unwrap_or_default()).collect(),
            drawn,
            placed,
            curves,
            turn,
            is_reversed: false,
        });
    }
    // A low panel above legs or a skirt is their band.
    if sheets.iter().any(|sheet| matches!(sheet.cover, Cover::Leg { .. } | Cover::Hip)) {
        for sheet in &mut sheets {
            let (low, high) = extent(sheet.placed.iter().map(|p| p.y));
            if sheet.cover == Cover::Torso && high - low < BAND_HEIGHT {
                sheet.cover = Cover::Band;
            }
        }
    }
    sheets
}

fn middle(points: &[Vec3]) -> Vec3 {
    points.iter().sum::<Vec3>() / points.len().max(1) as f64
}

/// Turned by more than this (degrees) in its plane, a panel without label is a sleeve.
const SLEEVE_TURN: f64 = 20.0;

/// A panel without label whose middle is lower than this (m) is below the waist.
const WAIST: f64 = 0.98;

fn cover(label: Option<&str>, placed: &[Vec3], turn: f64) -> Cover {
    let centre = middle(placed);
    let (low, high) = extent(placed.iter().map(|p| p.x));
    let is_left = centre.x > 0.0;
    let below = if low < -0.05 && high > 0.05 { Cover::Hip } else { Cover::Leg { is_left } };
    match label {
        Some("arm") => Cover::Arm { is_left },
        Some("leg") => below,
        Some("body") => Cover::Torso,
        _ if turn.abs() > SLEEVE_TURN => Cover::Arm { is_left },
        _ if centre.y < WAIST => below,
        _ => Cover::Torso,
    }
}

/// Control points that the file gives in the plane of the panel, relative to the edge.
fn relative_curve(curve: Curve, start: Vec2, end: Vec2, units: f64) -> Curve {
    let relative = |point: Vec2| relative_from_absolute(start, end, point / units);
    match curve {
        Curve::Quadratic(control) => Curve::Quadratic(relative(control)),
        Curve::Cubic(first, second) => Curve::Cubic(relative(first), relative(second)),
        other => other,
    }
}

/// The corners of each sheet in our panel space: where it lies on the body, x to the left, y up, loops turned so that they
/// run as their wrap wants.
fn lay_flat(sheets: &mut [Sheet], wearer: &Wearer) -> Vec<Vec<Vec2>> {
    let is_torso = |sheet: &&Sheet| sheet.cover == Cover::Torso;
    let is_lower = |sheet: &&Sheet| matches!(sheet.cover, Cover::Hip | Cover::Leg { .. });
    let heights = |wanted: &dyn Fn(&&Sheet) -> bool| {
        extent(sheets.iter().filter(|sheet| wanted(sheet)).flat_map(|sheet| &sheet.placed).map(|p| p.y))
    };
    let (torso_low, torso_high) = heights(&is_torso);
    let (_, lower_high) = heights(&is_lower);
    let (band_low, band_high) = heights(&|sheet| sheet.cover == Cover::Band);
    // What hangs below a top begins where the top ends.
    let lower_top =
        if torso_low.is_finite() { wearer.shoulder + torso_low - torso_high } else { NATURAL_WAIST * wearer.stature };
    // Whatever gap the file leaves between band and skirt is closed.
    let down = lower_top - (band_high - band_low).max(0.0) - lower_high - wearer.crotch;
    let arm_depth = |is_left: bool| {
        let arms: Vec<f64> =
            sheets.iter().filter(|s| s.cover == Cover::Arm { is_left }).map(|s| middle(&s.placed).z).collect();
        (arms.iter().sum::<f64>() / arms.len().max(1) as f64, arms.len())
    };
    let arms = [arm_depth(false), arm_depth(true)];
    let mut flat = Vec::with_capacity(sheets.len());
    for sheet in sheets {
        let mut corners: Vec<Vec2> = match sheet.cover {
            Cover::Torso => sheet.placed.iter().map(|p| Vec2::new(p.x, p.y - torso_high)).collect(),
            Cover::Band => {
                sheet.placed.iter().map(|p| Vec2::new(p.x, p.y - band_high + lower_top - wearer.crotch)).collect()
            }
            Cover::Hip => sheet.placed.iter().map(|p| Vec2::new(p.x, p.y + down)).collect(),
            Cover::Leg { .. } => {
                let (_, top) = extent(sheet.placed.iter().map(|p| p.y));
                let innermost = sheet.placed.iter().filter(|p| p.y > top - 0.03).map(|p| p.x);
                let centre = innermost.fold(f64::INFINITY, |best, x| if x.abs() < best.abs() { x } else { best });
                sheet.placed.iter().map(|p| Vec2::new(p.x - centre, p.y + down)).collect()
            }
            Cover::Arm { is_left } => {
                let (depth, count) = arms[usize::from(is_left)];
                sheet.is_front = middle(&sheet.placed).z >= depth;
                along_arm(sheet, is_left, count > 1)
            }
        };
        let is_backward =
            matches!(sheet.cover, Cover::Torso | Cover::Band | Cover::Hip | Cover::Leg { .. }) && !sheet.is_front;
        let wanted = if is_backward { -1.0 } else { 1.0 };
        if super::signed_area(&corners) * wanted < 0.0 {
            turn_round(sheet, &mut corners);
        }
        // A mirrored sheet bends its edges the other way.
        if super::signed_area(&corners).signum() * super::signed_area(&drawn_loop(sheet)).signum() < 0.0 {
            sheet.curves.iter_mut().for_each(|curve| *curve = curve.mirrored());
        }
        flat.push(corners);
    }
    flat
}

/// Takes what is too long off the legs, evenly between crotch and hem; how much (m).
fn shorten_legs(sheets: &[Sheet], flat: &mut [Vec<Vec2>], wearer: &Wearer) -> f64 {
    let is_leg = |sheet: &Sheet| matches!(sheet.cover, Cover::Leg { .. });
    let legs = sheets.iter().zip(flat.iter()).filter(|(sheet, _)| is_leg(sheet));
    let (hem, _) = extent(legs.flat_map(|(_, corners)| corners).map(|corner| corner.y));
    let lowest = FLOOR_CLEARANCE - wearer.crotch;
    if !(hem < lowest) {
        return 0.0;
    }
    for (_, corners) in sheets.iter().zip(flat).filter(|(sheet, _)| is_leg(sheet)) {
        corners.iter_mut().filter(|corner| corner.y < 0.0).for_each(|corner| corner.y *= lowest / hem);
    }
    lowest - hem
}

/// The corners as drawn, in the order in which the loop is walked now.
fn drawn_loop(sheet: &Sheet) -> Vec<Vec2> {
    if !sheet.is_reversed {
        return sheet.drawn.clone();
    }
    let count = sheet.drawn.len();
    (0..count).map(|i| sheet.drawn[(count - i) % count]).collect()
}

/// Walks a loop the other way round.
fn turn_round(sheet: &mut Sheet, corners: &mut Vec<Vec2>) {
    let count = corners.len();
    *corners = (0..count).map(|i| corners[(count - i) % count]).collect();
    sheet.curves = (0..count).map(|i| sheet.curves[count - 1 - i].reversed()).collect();
    sheet.labels.reverse();
    sheet.is_reversed = true;
}

/// A sleeve, or half of one, with its cap at y = 0 and the hem below, x from the top of the arm to the back on the left side
/// and to the front on the right.
fn along_arm(sheet: &Sheet, is_left: bool, is_half: bool) -> Vec<Vec2> {
    let to_body = if is_left { -1.0 } else { 1.0 };
    // Along the panel's own x, in the sense that leads to the body.
    let inward = if (sheet.turn * Vec3::X).x * to_body > 0.0 { 1.0 } else { -1.0 };
    let (_, cap) = extent(sheet.drawn.iter().map(|p| inward * p.x));
    let (low, high) = extent(sheet.drawn.iter().map(|p| p.y));
    let side = if sheet.is_front == is_left { -1.0 } else { 1.0 };
    let across = |p: &Vec2| if is_half { side * (high - p.y) } else { side * (0.5 * (low + high) - p.y) };
    sheet.drawn.iter().map(|p| Vec2::new(across(p), inward * p.x - cap)).collect()
}

/// The sizes, and for each the factors on widths, lengths and sleeve widths.
fn sizes(wearer: &Wearer, is_upper: bool) -> (Vec<Size>, Vec<[f64; 3]>) {
    let girths = wearer.girths;
    let (leading, slopes) = if is_upper { (girths.chest, UPPER_SLOPES) } else { (girths.hip, LOWER_SLOPES) };
    let steps = (0..=2 * SIZES_EACH_WAY).map(|index| STEP * (index as f64 - SIZES_EACH_WAY as f64));
    steps
        .map(|step| {
            let size = Size {
                name: format!("{:.0}", 100.0 * (leading + step)),
                chest_girth: girths.chest + slopes[0] * step,
                waist_girth: girths.waist + slopes[1] * step,
                hip_girth: girths.hip + slopes[2] * step,
            };
            let grade = step / leading;
            (size, [1.0 + grade, 1.0 + LENGTH_GRADE * grade, 1.0 + SLEEVE_GRADE * grade])
        })
        .unzip()
}

fn panel(sheet: &Sheet, corners: &[Vec2], scales: &[[f64; 3]], wearer: &Wearer) -> Panel {
    let outline = |&[width, length, sleeve]: &[f64; 3]| {
        let width = if matches!(sheet.cover, Cover::Arm { .. }) { sleeve } else { width };
        let vertices: Vec<Vec2> = corners.iter().map(|c| Vec2::new(c.x * width, c.y * length)).collect();
        let count = vertices.len();
        let chord = |points: &[Vec2], edge: usize| points[edge].distance(points[(edge + 1) % count]);
        let curves = sheet.curves.iter().enumerate().map(|(edge, curve)| match *curve {
            Curve::Arc { radius, large, counter_clockwise } => {
                let radius = radius * chord(&vertices, edge) / chord(corners, edge).max(f64::MIN_POSITIVE);
                Curve::Arc { radius, large, counter_clockwise }
            }
            other => other,
        });
        Outline { curves: curves.collect(), vertices: vertices.clone() }
    };
    let lower = |part: Part, y: f64| LowerPart { part, below: scales.iter().map(|scale| y * scale[1]).collect() };
    let knee = wearer.knee - wearer.crotch;
    let (wrap, part, lower_parts, covers) = match (sheet.cover, sheet.is_front) {
        (Cover::Torso, true) => (Wrap::TorsoFront, Part::Chest, Vec::new(), Vec::new()),
        (Cover::Torso, false) => (Wrap::TorsoBack, Part::Chest, Vec::new(), Vec::new()),
        (Cover::Band | Cover::Hip, is_front) => {
            let wrap = if is_front { Wrap::HipFront } else { Wrap::HipBack };
            let thighs = [Part::LeftThigh, Part::RightThigh];
            let covers = if sheet.cover == Cover::Hip { thighs.to_vec() } else { Vec::new() };
            (wrap, Part::Pelvis, Vec::new(), covers)
        }
        (Cover::Leg { is_left }, is_front) => {
            let wrap = match (is_left, is_front) {
                (true, true) => Wrap::LeftLegFront,
                (true, false) => Wrap::LeftLegBack,
                (false, true) => Wrap::RightLegFront,
                (false, false) => Wrap::RightLegBack,
            };
            let [thigh, shin] =
                if is_left { [Part::LeftThigh, Part::LeftShin] } else { [Part::RightThigh, Part::RightShin] };
            (wrap, Part::Pelvis, vec![lower(thigh, 0.0), lower(shin, knee)], Vec::new())
        }
        (Cover::Arm { is_left }, _) => {
            let (wrap, upper, forearm) = if is_left {
                (Wrap::LeftArm, Part::LeftUpperArm, Part::LeftForearm)
            } else {
                (Wrap::RightArm, Part::RightUpperArm, Part::RightForearm)
            };
            (wrap, upper, vec![lower(forearm, -wearer.upper_arm)], Vec::new())
        }
    };
    Panel {
        name: sheet.name.clone(),
        edge_labels: sheet.labels.clone(),
        outlines: scales.iter().map(outline).collect(),
        slim: Vec::new(),
        loose: Vec::new(),
        wrap,
        part,
        lower_parts,
        covers,
    }
}

/// Edges that no seam closes, at the upper end of the garment.
fn top_edges(pattern: &GradedPattern) -> Vec<EdgeId> {
    let top = |id: EdgeId| {
        let (start, end, _) = pattern.panels[id.panel].outlines[pattern.template_size].edge(id.edge);
        start.y.min(end.y)
    };
    let is_sleeve = |id: &EdgeId| matches!(pattern.panels[id.panel].wrap, Wrap::LeftArm | Wrap::RightArm);
    let ids = (0..pattern.panels.len())
        .flat_map(|panel| (0..pattern.panels[panel].edge_labels.len()).map(move |edge| EdgeId { panel, edge }));
    let open: Vec<EdgeId> =
        ids.filter(|id| !is_sleeve(id) && !pattern.stitches.iter().any(|stitch| stitch.sides.contains(id))).collect();
    let highest = open.iter().map(|&id| top(id)).fold(f64::NEG_INFINITY, f64::max);
    open.into_iter().filter(|&id| top(id) > highest - 0.06).collect()
}

/// Seams between front and back that lie on the shoulders, on the side of the front.
fn shoulder_edges(pattern: &GradedPattern) -> Vec<EdgeId> {
    let shoulder = |stitch: &Stitch| {
        let front = stitch.sides.into_iter().find(|id| pattern.panels[id.panel].wrap == Wrap::TorsoFront)?;
        stitch.sides.into_iter().find(|id| pattern.panels[id.panel].wrap == Wrap::TorsoBack)?;
        let (start, end, _) = pattern.panels[front.panel].outlines[pattern.template_size].edge(front.edge);
        // A shoulder runs across, near the top.
        ((start - end).x.abs() > (start - end).y.abs() && start.y.min(end.y) > -0.15).then_some(front)
    };
    pattern.stitches.iter().filter_map(shoulder).collect()
}

#[cfg(test)]
mod tests {
    use super::Wearer;
    use crate::cut::CutGarment;
    use crate::pattern::{Girths, GradedPattern, Wrap};
    use modiste_body::Gender;
    use std::io::Write;
    use std::sync::Arc;

    fn wearer() -> Wearer {
        Wearer {
            gender: Gender::Female,
            girths: Girths { chest: 0.95, waist: 0.86, hip: 1.02 },
            shoulder: 1.38,
            stature: 1.63,
            crotch: 0.74,
            knee: 0.45,
            upper_arm: 0.30,
        }
    }

    /// A skirt of two trapezoids with the band gathered to it, in centimetres, as GarmentCode draws one.
    const SKIRT: &str = r#"{"pattern": {"panels": {
        "front": {"translation": [-25, 60, 25], "rotation": [0, 0, 0], "vertices": [[0, 0], [50, 0], [50, 40], [0, 40]], "label": "leg",
            "edges": [{"endpoints": [0, 1]}, {"endpoints": [1, 2]}, {"endpoints": [2, 3]}, {"endpoints": [3, 0]}]},
        "back": {"translation": [-25, 60, -20], "rotation": [0, 0, 0], "vertices": [[0, 0], [0, 40], [50, 40], [50, 0]], "label": "leg",
            "edges": [{"endpoints": [0, 1]}, {"endpoints": [1, 2]}, {"endpoints": [2, 3]}, {"endpoints": [3, 0]}]},
        "band_f": {"translation": [-20, 104, 20], "rotation": [0, 0, 0], "vertices": [[0, 0], [40, 0], [40, 5], [0, 5]], "label": "body",
            "edges": [{"endpoints": [0, 1]}, {"endpoints": [1, 2]}, {"endpoints": [2, 3]}, {"endpoints": [3, 0]}]},
        "band_b": {"translation": [-20, 104, -15], "rotation": [0, 0, 0], "vertices": [[0, 0], [0, 5], [40, 5], [40, 0]], "label": "body",
            "edges": [{"endpoints": [0, 1]}, {"endpoints": [1, 2]}, {"endpoints": [2, 3]}, {"endpoints": [3, 0]}]}},
        "stitches": [[{"panel": "front", "edge": 3}, {"panel": "back", "edge": 0}], [{"panel": "front", "edge": 1}, {"panel": "back", "edge": 2}],
            [{"panel": "band_f", "edge": 3}, {"panel": "band_b", "edge": 0}], [{"panel": "band_f", "edge": 1}, {"panel": "band_b", "edge": 2}],
            [{"panel": "band_f", "edge": 0}, {"panel": "front", "edge": 2}], [{"panel": "band_b", "edge": 3}, {"panel": "back", "edge": 1}]]},
        "properties": {"units_in_meter": 100, "curvature_coords": "relative"}}"#;

    fn skirt(from: &str, to: &str) -> Result<GradedPattern, String> {
        let text = SKIRT.replace(from, to);
        let spec = modiste_io::pattern::parse(text.as_bytes(), "skirt.json").map_err(|error| error.to_string())?;
        GradedPattern::from_ungraded(&spec, "skirt.json", "skirt", None, &wearer())
            .map(|(pattern, _)| pattern)
            .map_err(|error| error.to_string())
    }

    #[test]
    fn a_plain_skirt_is_graded_and_closes_to_a_tube() {
        let pattern = skirt("", "").unwrap();
        assert!(pattern.sizes.len() >= 5);
        assert_eq!(pattern.panel("band_b").map(|p| pattern.panels[p].wrap), Some(Wrap::HipBack));
        assert_eq!(pattern.waist_band.len(), 2);
        // The size that was drawn is that of the wearer.
        assert!((pattern.choose_size(&wearer().girths) - pattern.template_size as f64).abs() < 1e-9);
        let cut = CutGarment::new(Arc::new(pattern), 0.03).unwrap();
        assert_eq!(modiste_core::boundary_loops(cut.topology()).len(), 2);
        assert!(cut.anchors().len() >= 16);
    }

    #[test]
    fn a_loop_walked_the_wrong_way_is_turned() {
        let clockwise = r#""vertices": [[0, 0], [0, 40], [50, 40], [50, 0]], "label": "leg""#;
        let plain = skirt("", "").unwrap();
        // The back as if it were a front: counter-clockwise, its edges in the opposite order.
        let text = SKIRT
            .replace(clockwise, r#""vertices": [[0, 0], [50, 0], [50, 40], [0, 40]], "label": "leg""#)
            .replace(r#"{"panel": "back", "edge": 0}"#, r#"{"panel": "back", "edge": 33}"#)
            .replace(r#"{"panel": "back", "edge": 2}"#, r#"{"panel": "back", "edge": 11}"#)
            .replace(r#"{"panel": "back", "edge": 1}"#, r#"{"panel": "back", "edge": 2}"#)
            .replace("33", "3")
            .replace("11}", "1}");
        let spec = modiste_io::pattern::parse(text.as_bytes(), "skirt.json").unwrap();
        let (turned, _) = GradedPattern::from_ungraded(&spec, "skirt.json", "skirt", None, &wearer()).unwrap();
        let (a, b) = (plain.panel("back").unwrap(), turned.panel("back").unwrap());
        assert!(plain.panels[a].orientation() * turned.panels[b].orientation() > 0.0);
        let cut = CutGarment::new(Arc::new(turned), 0.03).unwrap();
        assert_eq!(modiste_core::boundary_loops(cut.topology()).len(), 2);
    }

    #[test]
    fn what_cannot_be_worn_is_told() {
        let wrong = |from: &str, to: &str| skirt(from, to).unwrap_err();
        assert!(wrong(": 100,", ": 1,").contains("units_in_meter"), "{}", wrong(": 100,", ": 1,"));
        assert!(wrong(": 100,", ": 10000,").contains("units_in_meter"));
        // A band of a hand's breadth cannot take up the skirt.
        let narrow = wrong("[40, 0], [40, 5]", "[10, 0], [10, 5]");
        assert!(narrow.contains("seam 4") && narrow.contains("band_f"), "{narrow}");
        let crossed = wrong("[50, 0], [50, 40], [0, 40]], \"label\"", "[50, 40], [50, 0], [0, 40]], \"label\"");
        assert!(crossed.contains("front"), "{crossed}");
    }

    #[test]
    fn garmentcode_files_are_graded() {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/patterns/garmentcode");
        if !folder.is_dir() {
            drop(writeln!(std::io::stderr(), "skipped: there is no {}", folder.display()));
            return;
        }
        for gender in ["mean_female", "mean_male"] {
            for path in modiste_io::list_folder(folder.join(gender)).unwrap() {
                let name = path.display().to_string();
                let spec = modiste_io::pattern::read(&path).unwrap();
                let (pattern, notes) = GradedPattern::from_ungraded(&spec, &name, "x", None, &wearer()).unwrap();
                assert_eq!(notes.is_empty(), !name.contains("pants"), "{name} {notes:?}");
                let cut = CutGarment::new(Arc::new(pattern), 0.03).unwrap();
                let openings = modiste_core::boundary_loops(cut.topology()).len();
                let wanted = if name.contains("skirt") {
                    2
                } else if name.contains("shirt") {
                    4
                } else {
                    3
                };
                assert_eq!(openings, wanted, "{name}");
            }
        }
    }
}
