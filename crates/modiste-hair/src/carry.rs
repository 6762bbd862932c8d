//! Guides from elsewhere, carried to one of our heads.

use modiste_body::Body;
use modiste_core::{Topology, Vec3, centroid};

use crate::groom::{CLEARANCE, Groom};
use crate::guides::{arc_length, resample};
use crate::scalp::{Root, is_scalp, skull_middle, spread_roots};
use crate::surface::{Bust, Surface};
use crate::{Guides, HairError, POINTS};

/// Roots that our scalp is measured with.
const MEASURED: usize = 400;
/// A root further from our skin than this after carrying (m) is not that of hair on a head.
const FURTHEST: f64 = 0.05;
/// How short the hair is at length factor 0, as a part of the file's.
const SHORTEST: f64 = 0.45;
/// How far the skin is looked for (m).
const REACH: f64 = 0.3;

/// Carries curves of any unit (Y up, face to +Z) to a body's head: the middle and the spread of their roots go to those of
/// our scalp, then each guide to the skin below its root. `length` is the length factor: 1 is as in the file.
///
/// # Errors
/// Curves that are no hair, all roots in one place, or guides whose roots do not fit a head.
pub fn carry(body: &Body, curves: &[Vec<Vec3>], length: f64, count: Option<usize>) -> Result<Groom, HairError> {
    crate::error::check_range("length of the groom", length, 0.0, 1.0)?;
    let roots: Vec<Vec3> = curves.iter().filter_map(|curve| curve.first().copied()).collect();
    let (topology, rest) = (body.model().topology(), body.rest_vertices());
    let ours: Vec<Vec3> = spread_roots(body, MEASURED, 1)?.iter().map(|root| root.position(topology, rest)).collect();
    let spread = |points: &[Vec3]| {
        let middle = centroid(points);
        (points.iter().map(|p| p.distance_squared(middle)).sum::<f64>() / points.len().max(1) as f64).sqrt()
    };
    let size = spread(&roots);
    if !(size.is_finite() && size > 1e-9) {
        return Err(HairError::data("roots of the guides", "spread over a head", format!("within {size}")));
    }
    let scale = spread(&ours) / size;
    let (from, to) = (centroid(&roots), centroid(&ours));
    let placed: Vec<Vec<Vec3>> =
        curves.iter().map(|curve| curve.iter().map(|&p| to + scale * (p - from)).collect()).collect();
    // Checked as they come, before anything is cut.
    Guides::from_curves(&placed)?;
    let bust = Bust::new(body.model())?;
    let surface = bust.surface(rest);
    let mut groom = Groom { roots: Vec::new(), guides: Guides::default(), clearances: Vec::new() };
    for (index, curve) in placed.iter().enumerate().take(count.unwrap_or(usize::MAX)) {
        let root = root_below(curve[0], index, &surface, &bust, topology, rest)?;
        if !is_scalp(root.position(topology, rest) - skull_middle(body) + Vec3::new(0.0, 0.03, 0.0)) {
            return Err(HairError::data(format!("root of guide {index}"), "on the scalp", curve[0]));
        }
        let shift = root.position(topology, rest) - curve[0];
        let part = SHORTEST + length * (1.0 - SHORTEST);
        let cut = cut(curve, part * arc_length(curve));
        groom.guides.points.extend(
            resample(&cut, POINTS)
                .into_iter()
                .enumerate()
                .map(|(point, p)| if point == 0 { p + shift } else { surface.pushed_out(p + shift, CLEARANCE, 0.08) }),
        );
        groom.roots.push(root);
        groom.clearances.push(CLEARANCE);
    }
    Ok(groom)
}

fn root_below(
    p: Vec3,
    guide: usize,
    surface: &Surface,
    bust: &Bust,
    topology: &Topology,
    rest: &[Vec3],
) -> Result<Root, HairError> {
    let far = |distance: String| {
        HairError::data(format!("root of guide {guide}"), format!("within {FURTHEST} m of the head"), distance)
    };
    let contact = surface.contact(p, REACH, None).ok_or_else(|| far(format!("more than {REACH} m")))?;
    if contact.at.distance > FURTHEST {
        return Err(far(format!("{:.3} m", contact.at.distance)));
    }
    let wanted = surface.topology().faces()[contact.at.face as usize].map(|vertex| bust.vertices()[vertex as usize]);
    // Faces of the bust are faces of the body; the one at the first vertex that has all three.
    let around = topology.vertex_faces(wanted[0] as usize);
    let face = around.iter().find(|&&face| topology.faces()[face as usize] == wanted);
    let face = *face.ok_or_else(|| HairError::data("bust", "faces of the body", rest.len()))?;
    Ok(Root { face, barycentric: contact.at.barycentric })
}

/// The first `length` of a curve.
fn cut(curve: &[Vec3], length: f64) -> Vec<Vec3> {
    let mut kept = vec![curve[0]];
    let mut left = length;
    for pair in curve.windows(2) {
        let step = pair[0].distance(pair[1]);
        if step >= left {
            kept.push(pair[0].lerp(pair[1], if step > 0.0 { left / step } else { 0.0 }));
            break;
        }
        left -= step;
        kept.push(pair[1]);
    }
    kept
}
