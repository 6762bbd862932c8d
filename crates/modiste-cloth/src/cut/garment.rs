//! A garment cut in every size on one shared mesh, with its seams.

use std::sync::Arc;

use modiste_body::Part;
use modiste_core::{SolveError, Topology, TopologyError, Vec2};

use super::align::{AlignQuality, align_panel};
use super::panel_mesh::{PanelMesh, mesh_panel};
use crate::pattern::{Cut, EdgeId, Fitting, GradedPattern, Outline, PatternFault};

/// Why a garment could not be cut.
#[derive(Debug, thiserror::Error)]
pub enum CutError {
    /// The pattern does not fit together.
    #[error("the pattern cannot be cut: {0}")]
    Pattern(#[from] PatternFault),
    /// The alignment of a size could not be solved.
    #[error("panel {panel} of size {size} cannot be aligned to the template size: {source}")]
    Align {
        /// Name of the panel.
        panel: String,
        /// Name of the size.
        size: String,
        /// The solver's reason.
        source: SolveError,
    },
    /// A triangle turned over in a size.
    #[error("panel {panel} of size {size} has a triangle of {ratio:.3} times its share of the area")]
    TurnedOver {
        /// Name of the panel.
        panel: String,
        /// Name of the size.
        size: String,
        /// The area ratio.
        ratio: f64,
    },
    /// The seams close to something that is no surface.
    #[error("the seams do not close to a mesh: {0}")]
    Weld(#[from] TopologyError),
    /// The edge length asked for is no length.
    #[error("edge length {0} m; a length between 0.002 and 0.2 m is wanted")]
    EdgeLength(f64),
}

/// A garment cut in all sizes: one triangulation, one rest shape per size.
///
/// "Loose" vertices are those of the separate panels, one panel after the other; "welded" ones are those of the sewn
/// garment, where the vertices along a seam are one.
#[derive(Debug, Clone)]
pub struct CutGarment {
    pattern: Arc<GradedPattern>,
    panels: Vec<PanelMesh>,
    panel_starts: Vec<u32>,
    loose: Arc<Topology>,
    sewn: Arc<Topology>,
    welded_from_loose: Vec<u32>,
    seam_pairs: Vec<[u32; 2]>,
    /// For each cut that the pattern has, the regular one first, and each size.
    points: Vec<(Cut, Vec<Vec<Vec2>>)>,
    quality: Vec<AlignQuality>,
    face_parts: Vec<Part>,
    waist_band: Vec<[u32; 2]>,
    ribs: Vec<RibEdge>,
    anchors: Vec<u32>,
}

/// One mesh edge with a knitted rib along it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RibEdge {
    /// Its loose vertices.
    pub loose: [u32; 2],
    /// Its welded vertices.
    pub vertices: [u32; 2],
    /// Rest length over the length in the panel.
    pub scale: f64,
    /// Force at a stretch of one (N).
    pub modulus: f64,
}

impl CutGarment {
    /// Meshes the template size at about `edge_length` (m) and aligns every other size to it.
    ///
    /// # Errors
    /// [`CutError`] with the panel and size at fault.
    pub fn new(pattern: Arc<GradedPattern>, edge_length: f64) -> Result<Self, CutError> {
        if !(0.002..=0.2).contains(&edge_length) {
            return Err(CutError::EdgeLength(edge_length));
        }
        pattern.check()?;
        let panels = mesh_panels(&pattern, edge_length);
        let mut panel_starts = vec![0u32];
        for panel in &panels {
            panel_starts.push(panel_starts[panel_starts.len() - 1] + panel.points.len() as u32);
        }
        let (points, quality) = align_all(&pattern, &panels)?;
        let loose_count = panel_starts[panels.len()] as usize;
        let loose_faces = loose_faces(&pattern, &panels, &panel_starts);
        let edge = |id: EdgeId| -> Vec<u32> {
            panels[id.panel].edge_vertices(id.edge).iter().map(|v| v + panel_starts[id.panel]).collect()
        };
        let mut seam_pairs = Vec::new();
        for stitch in &pattern.stitches {
            let [a, b] = stitch.sides.map(edge);
            seam_pairs.extend(a.iter().zip(b.iter().rev()).map(|(&a, &b)| [a, b]).filter(|[a, b]| a != b));
        }
        let (welded_from_loose, sewn_count) = weld(loose_count, &seam_pairs);
        let sewn_faces = loose_faces.iter().map(|f| f.map(|v| welded_from_loose[v as usize])).collect();
        let welded = |v: &u32| welded_from_loose[*v as usize];
        let mut ribs = Vec::new();
        for rib in &pattern.ribs {
            let run = edge(rib.edge);
            ribs.extend(run.windows(2).map(|pair| RibEdge {
                loose: [pair[0], pair[1]],
                vertices: [welded(&pair[0]), welded(&pair[1])],
                scale: rib.scale,
                modulus: rib.modulus,
            }));
        }
        let band_edges = pattern.waist_band.iter().map(|&id| edge(id).iter().map(welded).collect::<Vec<u32>>());
        let waist_band = band_edges.flat_map(|run| run.windows(2).map(|w| [w[0], w[1]]).collect::<Vec<_>>()).collect();
        let mut anchors: Vec<u32> = Vec::new();
        for anchor in &pattern.anchors {
            let run: Vec<u32> = edge(anchor.edge).iter().map(welded).collect();
            for i in 0..anchor.count {
                let vertex = run[((i as f64 + 0.5) / anchor.count as f64 * (run.len() - 1) as f64).round() as usize];
                if !anchors.contains(&vertex) {
                    anchors.push(vertex);
                }
            }
        }
        Ok(Self {
            face_parts: face_parts(&pattern, &panels),
            loose: Arc::new(Topology::new(loose_count, loose_faces)?),
            sewn: Arc::new(Topology::new(sewn_count, sewn_faces)?),
            pattern,
            panels,
            panel_starts,
            welded_from_loose,
            seam_pairs,
            points,
            quality,
            waist_band,
            ribs,
            anchors,
        })
    }

    /// The edge length (m) at which the template size of `pattern` gets about `vertex_count` vertices.
    pub fn edge_length_for(pattern: &GradedPattern, vertex_count: usize) -> f64 {
        let area: f64 = pattern.panels.iter().map(|p| p.outlines[pattern.template_size].signed_area().abs()).sum();
        // An equilateral lattice has one vertex per sqrt(3)/2 · edge²; the border adds a few per cent.
        (1.035 * area / (0.75f64.sqrt() * vertex_count.max(1) as f64)).sqrt()
    }

    /// The pattern it was cut from.
    pub fn pattern(&self) -> &Arc<GradedPattern> {
        &self.pattern
    }

    /// The panels' meshes in the template size.
    pub fn panels(&self) -> &[PanelMesh] {
        &self.panels
    }

    /// The loose vertices of a panel.
    pub fn panel_range(&self, panel: usize) -> std::ops::Range<usize> {
        self.panel_starts[panel] as usize..self.panel_starts[panel + 1] as usize
    }

    /// The separate panels as one mesh.
    pub fn loose_topology(&self) -> &Arc<Topology> {
        &self.loose
    }

    /// The sewn garment's mesh; its faces are those of the loose one, in the same order.
    pub fn topology(&self) -> &Arc<Topology> {
        &self.sewn
    }

    /// The welded vertex of each loose one.
    pub fn welded_from_loose(&self) -> &[u32] {
        &self.welded_from_loose
    }

    /// Pairs of loose vertices that are sewn together.
    pub fn seam_pairs(&self) -> &[[u32; 2]] {
        &self.seam_pairs
    }

    /// Panel-space position (m) of each loose vertex in a size and ease, as drawn; between two sizes or cuts on the way from
    /// one to the other.
    pub fn points(&self, fitting: impl Into<Fitting>) -> Vec<Vec2> {
        self.pattern.at(fitting.into(), |cut, size| {
            let of_cut = self.points.iter().find(|(drawn, _)| *drawn == cut).unwrap_or(&self.points[0]);
            &of_cut.1[size]
        })
    }

    /// Rest shape of each face in a size and ease: corners in panel space (m) seen from outside, counter-clockwise.
    pub fn rest_faces(&self, fitting: impl Into<Fitting>) -> Vec<[Vec2; 3]> {
        let points = self.points(fitting);
        let mut rest = Vec::with_capacity(self.loose.face_count());
        for (panel, range) in self.face_ranges().enumerate() {
            let sense = self.pattern.panels[panel].orientation();
            for face in &self.loose.faces()[range] {
                rest.push(face.map(|v| Vec2::new(sense * points[v as usize].x, points[v as usize].y)));
            }
        }
        rest
    }

    /// How well each panel of each size of each cut took the template's triangulation; cuts outermost, then sizes.
    pub fn align_quality(&self) -> &[AlignQuality] {
        &self.quality
    }

    /// The body part of each face.
    pub fn face_parts(&self) -> &[Part] {
        &self.face_parts
    }

    /// The edges of the waist band (welded vertices), empty where there is none.
    pub fn waist_band(&self) -> &[[u32; 2]] {
        &self.waist_band
    }

    /// The edges with a knitted rib along them.
    pub fn ribs(&self) -> &[RibEdge] {
        &self.ribs
    }

    /// The welded vertices that carry anchors.
    pub fn anchors(&self) -> &[u32] {
        &self.anchors
    }

    /// Texture coordinates of the corners of each face: the panels of the template size side by side, in the unit square.
    pub fn uv(&self) -> Vec<[[f32; 2]; 3]> {
        let points = &self.points[0].1[self.pattern.template_size];
        let gap = 0.02;
        let mut shifts = Vec::with_capacity(self.panels.len());
        let (mut width, mut height) = (0.0, 0.0f64);
        for panel in 0..self.panels.len() {
            let run = &points[self.panel_range(panel)];
            let low = run.iter().fold(Vec2::INFINITY, |l, p| l.min(*p));
            let high = run.iter().fold(Vec2::NEG_INFINITY, |h, p| h.max(*p));
            shifts.push(Vec2::new(width, 0.0) - low);
            width += high.x - low.x + gap;
            height = height.max(high.y - low.y);
        }
        let scale = 1.0 / width.max(height);
        let mut uv = Vec::with_capacity(self.loose.face_count());
        for (panel, range) in self.face_ranges().enumerate() {
            for face in &self.loose.faces()[range] {
                uv.push(face.map(|v| {
                    let p = (points[v as usize] + shifts[panel]) * scale;
                    [p.x as f32, p.y as f32]
                }));
            }
        }
        uv
    }

    /// The faces of each panel.
    pub fn face_ranges(&self) -> impl Iterator<Item = std::ops::Range<usize>> + '_ {
        let mut start = 0;
        self.panels.iter().map(move |panel| {
            let range = start..start + panel.faces.len();
            start = range.end;
            range
        })
    }
}

/// Meshes all panels of the template size; a panel that mirrors an earlier one takes its mirrored mesh.
fn mesh_panels(pattern: &GradedPattern, edge_length: f64) -> Vec<PanelMesh> {
    let segments = edge_segments(pattern, edge_length);
    let mut meshes: Vec<PanelMesh> = Vec::with_capacity(pattern.panels.len());
    for (index, panel) in pattern.panels.iter().enumerate() {
        let outline = &panel.outlines[pattern.template_size];
        let twin = (0..index).find(|&other| {
            let reversed: Vec<usize> = segments[other].iter().rev().copied().collect();
            reversed == segments[index] && mirrors(outline, &pattern.panels[other].outlines[pattern.template_size])
        });
        meshes.push(match twin {
            Some(twin) => meshes[twin].mirrored(),
            None => mesh_panel(outline, &segments[index], edge_length),
        });
    }
    meshes
}

/// Whether an outline is another one mirrored left to right, walked backwards.
fn mirrors(outline: &Outline, other: &Outline) -> bool {
    let count = outline.vertices.len();
    count == other.vertices.len()
        && (0..count).all(|i| {
            let twin = other.vertices[(count - i) % count];
            let same_length = (outline.edge_length(i) - other.edge_length(count - 1 - i)).abs() < 1e-6;
            outline.vertices[i].distance(Vec2::new(-twin.x, twin.y)) < 1e-6 && same_length
        })
}

/// Segments of every edge: the same on both sides of a seam.
fn edge_segments(pattern: &GradedPattern, edge_length: f64) -> Vec<Vec<usize>> {
    let length = |id: EdgeId| pattern.panels[id.panel].outlines[pattern.template_size].edge_length(id.edge);
    let count = |length: f64| ((length / edge_length).round() as usize).max(1);
    let mut segments: Vec<Vec<usize>> = (0..pattern.panels.len())
        .map(|panel| {
            let edges = pattern.panels[panel].edge_labels.len();
            (0..edges).map(|edge| count(length(EdgeId { panel, edge }))).collect()
        })
        .collect();
    // An edge nearly fine enough for a vertex per anchor gets one.
    for anchor in &pattern.anchors {
        let EdgeId { panel, edge } = anchor.edge;
        let (natural, wanted) = (segments[panel][edge], anchor.count.saturating_sub(1));
        if natural < wanted && 4 * natural >= 3 * wanted {
            segments[panel][edge] = wanted;
        }
    }
    for stitch in &pattern.stitches {
        let [a, b] = stitch.sides;
        let longest = segments[a.panel][a.edge].max(segments[b.panel][b.edge]);
        let shared = longest.max(count(0.5 * (length(a) + length(b))));
        segments[a.panel][a.edge] = shared;
        segments[b.panel][b.edge] = shared;
    }
    segments
}

type Aligned = (Vec<(Cut, Vec<Vec<Vec2>>)>, Vec<AlignQuality>);

fn align_all(pattern: &GradedPattern, panels: &[PanelMesh]) -> Result<Aligned, CutError> {
    let cuts = [Cut::Regular, Cut::Slim, Cut::Loose];
    let cuts = &cuts[..if pattern.has_ease() { 3 } else { 1 }];
    let mut points = Vec::with_capacity(cuts.len());
    let mut qualities = Vec::new();
    for &cut in cuts {
        let of_cut = (0..pattern.sizes.len())
            .map(|size| align_size(pattern, panels, (cut, size), &mut qualities))
            .collect::<Result<_, _>>()?;
        points.push((cut, of_cut));
    }
    Ok((points, qualities))
}

/// The loose vertices (m) in one size of one cut.
fn align_size(
    pattern: &GradedPattern,
    panels: &[PanelMesh],
    (cut, size): (Cut, usize),
    qualities: &mut Vec<AlignQuality>,
) -> Result<Vec<Vec2>, CutError> {
    let name = || match cut {
        Cut::Regular => pattern.sizes[size].name.clone(),
        Cut::Slim | Cut::Loose => format!("{} {}", pattern.sizes[size].name, cut.name()),
    };
    let mut points = Vec::new();
    for (mesh, panel) in panels.iter().zip(&pattern.panels) {
        let (aligned, quality) = align_panel(mesh, &panel.in_cut(cut)[size]).map_err(|source| CutError::Align {
            panel: panel.name.clone(),
            size: name(),
            source,
        })?;
        if quality.min_area_ratio <= 0.0 {
            let (panel, size) = (panel.name.clone(), name());
            return Err(CutError::TurnedOver { panel, size, ratio: quality.min_area_ratio });
        }
        points.extend(aligned);
        qualities.push(quality);
    }
    Ok(points)
}

/// Faces over loose vertices, counter-clockwise seen from outside.
fn loose_faces(pattern: &GradedPattern, panels: &[PanelMesh], starts: &[u32]) -> Vec<[u32; 3]> {
    let mut faces = Vec::new();
    for ((mesh, panel), start) in panels.iter().zip(&pattern.panels).zip(starts) {
        let turned = panel.orientation() < 0.0;
        faces.extend(mesh.faces.iter().map(|&[a, b, c]| {
            let face = if turned { [a, c, b] } else { [a, b, c] };
            face.map(|v| v + start)
        }));
    }
    faces
}

fn face_parts(pattern: &GradedPattern, panels: &[PanelMesh]) -> Vec<Part> {
    let mut parts = Vec::new();
    for (mesh, panel) in panels.iter().zip(&pattern.panels) {
        parts.extend(mesh.faces.iter().map(|face| {
            let height = face.iter().map(|&v| mesh.points[v as usize].y).sum::<f64>() / 3.0;
            let lower = panel.lower_parts.iter().rev().find(|lower| height < lower.below[pattern.template_size]);
            lower.map_or(panel.part, |lower| lower.part)
        }));
    }
    parts
}

/// The welded vertex of each loose one (numbered by first appearance) and how many there are.
fn weld(count: usize, pairs: &[[u32; 2]]) -> (Vec<u32>, usize) {
    let mut root: Vec<u32> = (0..count as u32).collect();
    fn find(root: &mut [u32], mut v: u32) -> u32 {
        while root[v as usize] != v {
            root[v as usize] = root[root[v as usize] as usize];
            v = root[v as usize];
        }
        v
    }
    for &[a, b] in pairs {
        let (a, b) = (find(&mut root, a), find(&mut root, b));
        root[a.max(b) as usize] = a.min(b);
    }
    let mut numbers = vec![u32::MAX; count];
    let mut next = 0;
    for v in 0..count as u32 {
        let r = find(&mut root, v) as usize;
        if numbers[r] == u32::MAX {
            numbers[r] = next;
            next += 1;
        }
        numbers[v as usize] = numbers[r];
    }
    (numbers, next as usize)
}

#[cfg(test)]
mod tests {
    use super::CutGarment;
    use crate::pattern::{GARMENTS, Girths, builtin};
    use modiste_body::{Gender, Part};
    use modiste_core::boundary_loops;
    use std::sync::Arc;

    fn cut(garment: &str, gender: Gender, edge_length: f64) -> CutGarment {
        CutGarment::new(Arc::new(builtin(garment, gender).unwrap().unwrap()), edge_length).unwrap()
    }

    #[test]
    fn sewn_garments_are_surfaces_with_the_right_openings() {
        for gender in Gender::ALL {
            for (garment, openings) in GARMENTS.iter().zip([4, 4, 3, 3, 2]) {
                let cut = cut(garment, gender, 0.03);
                let topology = cut.topology();
                // Neck, hem and two sleeves; waist and two legs; waist and hem.
                assert_eq!(boundary_loops(topology).len(), openings, "{garment}");
                let (v, e, f) = (topology.vertex_count(), topology.edges().len(), topology.face_count());
                // A sphere with n holes has V - E + F = 2 - n.
                assert_eq!(v as i64 - e as i64 + f as i64, 2 - openings as i64, "{garment}");
                assert!(topology.edges().iter().all(|edge| edge.faces[0].is_some()));
                // Neighbouring faces agree on their outside: each edge is walked both ways.
                let mut directed = std::collections::BTreeSet::new();
                for face in topology.faces() {
                    for corner in 0..3 {
                        assert!(directed.insert((face[corner], face[(corner + 1) % 3])), "{garment}");
                    }
                }
            }
        }
    }

    #[test]
    fn rest_faces_face_outward_and_keep_the_area_of_the_size() {
        let cut = cut("tshirt", Gender::Male, 0.03);
        for size in [0, 6, 16] {
            let rest = cut.rest_faces(size as f64);
            let area: f64 = rest.iter().map(|r| crate::pattern::signed_area(r)).sum();
            assert!(rest.iter().all(|r| crate::pattern::signed_area(r) > 0.0));
            let outlines: f64 = cut.pattern().panels.iter().map(|p| p.outlines[size].signed_area().abs()).sum();
            assert!((area / outlines - 1.0).abs() < 0.01, "{area} {outlines}");
        }
    }

    #[test]
    fn sizes_between_are_on_the_way_from_one_to_the_next() {
        let cut = cut("shorts", Gender::Female, 0.03);
        let pattern = cut.pattern();
        let girths = |hip: f64| Girths { chest: 0.9, waist: hip - 0.2, hip };
        // A centimetre of hip is a quarter of a step of four, wherever it is.
        for hip in [0.90, 0.93, 1.0, 1.21] {
            let step = pattern.choose_size(&girths(hip + 0.01)) - pattern.choose_size(&girths(hip));
            assert!((step - 0.25).abs() < 1e-9, "{hip} {step}");
        }
        assert!(pattern.choose_size(&girths(0.5)).abs() < 1e-12);
        assert!((pattern.choose_size(&girths(2.0)) - (pattern.sizes.len() - 1) as f64).abs() < 1e-12);
        let area = |size: f64| cut.rest_faces(size).iter().map(|r| crate::pattern::signed_area(r)).sum::<f64>();
        let [small, between, large] = [4.0, 4.3, 5.0].map(area);
        assert!((between - (0.7 * small + 0.3 * large)).abs() < 1e-3 * small, "{small} {between} {large}");
        assert_eq!((pattern.size_name(4.3), pattern.size_name(4.6)), ("94", "98"));
    }

    #[test]
    fn seams_anchors_and_band_are_where_they_should_be() {
        let shirt = cut("tshirt", Gender::Female, 0.0145);
        assert_eq!(shirt.anchors().len(), 20);
        assert!(shirt.waist_band().is_empty());
        let shorts = cut("shorts", Gender::Female, 0.0145);
        assert_eq!(shorts.anchors().len(), 20);
        assert!(shorts.waist_band().len() > 40);
        for part in [Part::Pelvis, Part::LeftThigh, Part::RightThigh] {
            assert!(shorts.face_parts().iter().filter(|p| **p == part).count() > 200, "{part:?}");
        }
        // The two sides of each seam have segments of equal length in every size.
        for garment in [&shirt, &shorts] {
            for size in 0..garment.pattern().sizes.len() {
                let points = garment.points(size as f64);
                for pair in garment.seam_pairs().windows(2) {
                    let [a, b] =
                        [0, 1].map(|side| points[pair[0][side] as usize].distance(points[pair[1][side] as usize]));
                    // Pairs of different seams follow each other now and then: those are far apart.
                    if a < 0.03 && b < 0.03 {
                        assert!((a - b).abs() <= 0.05 * a, "size {size}: {a} {b}");
                    }
                }
            }
        }
    }

    #[test]
    fn the_vertex_count_is_near_the_wanted_one() {
        for garment in GARMENTS {
            let pattern = builtin(garment, Gender::Female).unwrap().unwrap();
            let edge_length = CutGarment::edge_length_for(&pattern, 4500);
            let count = cut(garment, Gender::Female, edge_length).topology().vertex_count();
            assert!((4200..4800).contains(&count), "{garment}: {count}");
        }
    }
}
