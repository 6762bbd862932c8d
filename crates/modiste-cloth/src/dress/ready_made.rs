//! A sewn garment mesh without a pattern: what the body under it tells of it.

use std::collections::BTreeMap;
use std::sync::Arc;

use modiste_body::{Gender, Part};
use modiste_core::{Topology, TriangleBvh, Vec2, Vec3, boundary_loops, connected_components, face_areas, face_normals};
use serde::{Deserialize, Serialize};

use super::carry::Carrier;
use super::{DressError, Mannequin};
use crate::{ClothModel, Fabric};

/// Most triangles that are simulated.
const MOST_TRIANGLES: usize = 60_000;

/// Triangles below this area (m²) have no rest shape.
const LEAST_AREA: f64 = 1e-8;

/// Vertices nearer than this (m) are one.
const WELD: f64 = 1e-6;

/// A garment is on its body if half its vertices are nearer than this (m) …
const FARTHEST_MEDIAN: f64 = 0.25;

/// … and no more than this share of them lies deeper than [`DEEP`] (m) inside.
const MOST_INSIDE: f64 = 0.3;
const DEEP: f64 = 0.02;

/// Rounds in which a face takes the part that most of its neighbours have.
const PART_ROUNDS: usize = 3;

/// Vertices that carry anchors, about.
const ANCHORS: usize = 20;

/// A garment that was made elsewhere, as it lies on the mean body in the template pose.
///
/// The mesh is its own rest shape: edges keep their lengths and folds their angles. For other bodies it is made to measure:
/// the rest shape goes with the surface of the body.
#[derive(Debug, Clone)]
pub struct ReadyMade {
    garment: String,
    gender: String,
    material: String,
    /// On the mean body (m).
    positions: Vec<Vec3>,
    topology: Arc<Topology>,
    face_parts: Vec<Part>,
    covers: Vec<(u32, Part)>,
    band: Vec<u32>,
    anchors: Vec<u32>,
    /// From the mean body, whose vertices these are.
    carrier: Carrier,
    mean: Vec<Vec3>,
}

/// What is kept of it beside a training set and in a model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct File {
    /// Tells it from a pattern.
    ready_made: u32,
    garment: String,
    gender: String,
    material: String,
    /// On the mean body (m).
    vertices: Vec<[f64; 3]>,
    faces: Vec<[u32; 3]>,
}

const VERSION: u32 = 1;

/// Why a mesh cannot be worn.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ReadyMadeError {
    /// Nothing there.
    #[error("{name}: a garment mesh with triangles was wanted, found none")]
    Empty {
        /// The garment.
        name: String,
    },
    /// More than can be simulated.
    #[error("{name}: at most {MOST_TRIANGLES} triangles were wanted, found {found}; make the mesh coarser first")]
    TooFine {
        /// The garment.
        name: String,
        /// Number of triangles.
        found: usize,
    },
    /// Edges with three faces, or neighbours that face opposite ways.
    #[error("{name}: a surface was wanted, found: {why}")]
    NotASurface {
        /// The garment.
        name: String,
        /// What is wrong where.
        why: String,
    },
    /// A triangle without area.
    #[error("{name}: triangles with area were wanted, found {area:.2e} m² in triangle {face}")]
    Flat {
        /// The garment.
        name: String,
        /// The triangle.
        face: usize,
        /// Its area (m²).
        area: f64,
    },
    /// More than one piece.
    #[error("{name}: a garment in one piece was wanted, found {found} pieces; the smallest has {smallest} vertices")]
    Pieces {
        /// The garment.
        name: String,
        /// Number of pieces.
        found: usize,
        /// Vertices of the smallest.
        smallest: usize,
    },
    /// Not where the body is.
    #[error(
        "{name}: a garment on its body was wanted, found one {distance:.2} m away from it (half of its vertices are farther)"
    )]
    Away {
        /// The garment.
        name: String,
        /// Median distance (m).
        distance: f64,
    },
    /// In the body.
    #[error("{name}: a garment around its body was wanted, found {share:.0} % of it more than 2 cm inside")]
    Inside {
        /// The garment.
        name: String,
        /// Share of the vertices (%).
        share: f64,
    },
    /// No opening.
    #[error("{name}: a garment that one can put on was wanted, found a closed surface without openings")]
    Closed {
        /// The garment.
        name: String,
    },
    /// A stored garment that cannot be read.
    #[error("{name}: a ready-made garment was wanted, found {why}")]
    File {
        /// The file.
        name: String,
        /// What is wrong.
        why: String,
    },
}

impl ReadyMade {
    /// Takes a mesh (m) as it lies on `worn_on`, a body in the template pose, and carries it to `mean`.
    ///
    /// Vertices in one place are joined, unused ones dropped, and faces that look inward are turned.
    ///
    /// # Errors
    /// [`ReadyMadeError`] with the plain reason.
    pub fn new(
        named: (&str, Gender, &str),
        vertices: &[Vec3],
        triangles: &[[u32; 3]],
        worn_on: &Mannequin,
        mean: &Mannequin,
    ) -> Result<Self, ReadyMadeError> {
        Self::with_sources(named, vertices, triangles, worn_on, mean).map(|(garment, _)| garment)
    }

    /// As [`Self::new`], with the vertex of the mesh given that each vertex of the garment was.
    ///
    /// # Errors
    /// [`ReadyMadeError`] with the plain reason.
    pub fn with_sources(
        (garment, gender, material): (&str, Gender, &str),
        vertices: &[Vec3],
        triangles: &[[u32; 3]],
        worn_on: &Mannequin,
        mean: &Mannequin,
    ) -> Result<(Self, Vec<u32>), ReadyMadeError> {
        let name = garment.to_owned();
        if triangles.len() > MOST_TRIANGLES {
            return Err(ReadyMadeError::TooFine { name, found: triangles.len() });
        }
        if let Some(vertex) = triangles.as_flattened().iter().find(|&&vertex| vertex as usize >= vertices.len()) {
            let why = format!("vertex {vertex}, where there are {}", vertices.len());
            return Err(ReadyMadeError::NotASurface { name, why });
        }
        let (sources, mut faces) = welded(vertices, triangles);
        let vertices: Vec<Vec3> = sources.iter().map(|&source| vertices[source as usize]).collect();
        if faces.is_empty() {
            return Err(ReadyMadeError::Empty { name });
        }
        if let Some((face, area)) = flattest(&vertices, &faces).filter(|&(_, area)| area < LEAST_AREA) {
            return Err(ReadyMadeError::Flat { name, face, area });
        }
        let surface = |faces: Vec<[u32; 3]>| {
            Topology::new(vertices.len(), faces)
                .map_err(|error| ReadyMadeError::NotASurface { name: garment.to_owned(), why: error.to_string() })
        };
        faces = oriented(&faces).map_err(|why| ReadyMadeError::NotASurface { name: garment.to_owned(), why })?;
        let mut topology = surface(faces.clone())?;
        if let Some(vertex) = touching(&topology) {
            let why = format!("parts that touch in vertex {} alone", sources[vertex]);
            return Err(ReadyMadeError::NotASurface { name, why });
        }
        let pieces = connected_components(&topology);
        if pieces.len() > 1 {
            let smallest = pieces.iter().map(Vec::len).min().unwrap_or(0);
            return Err(ReadyMadeError::Pieces { name, found: pieces.len(), smallest });
        }
        if boundary_loops(&topology).is_empty() {
            return Err(ReadyMadeError::Closed { name });
        }
        let tree = TriangleBvh::new(&worn_on.topology, &worn_on.vertices);
        check_place(&name, &vertices, worn_on, &tree)?;
        if is_inside_out(&topology, &vertices, worn_on, &tree) {
            faces.iter_mut().for_each(|face| face.swap(1, 2));
            topology = surface(faces.clone())?;
        }
        let carried =
            Carrier::new(&vertices, &worn_on.vertices).carry(&topology, &vertices, &worn_on.vertices, &mean.vertices);
        Ok((Self::assemble([garment, gender.name(), material], carried, topology, mean), sources))
    }

    /// Whether a stored text is that of a ready-made garment.
    pub fn is_one(text: &str) -> bool {
        text.starts_with("{\"ready_made\"")
    }

    /// What is stored of it.
    pub fn to_json(&self) -> String {
        let file = File {
            ready_made: VERSION,
            garment: self.garment.clone(),
            gender: self.gender.clone(),
            material: self.material.clone(),
            vertices: self.positions.iter().map(|x| x.to_array()).collect(),
            faces: self.topology.faces().to_vec(),
        };
        // Numbers and names always serialise.
        serde_json::to_string(&file).unwrap_or_default()
    }

    /// Reads a stored one; `name` stands for the file in errors.
    ///
    /// # Errors
    /// What is wrong with the text.
    pub fn from_json(name: &str, text: &str, mean: &Mannequin) -> Result<Self, ReadyMadeError> {
        let wrong = |why: String| ReadyMadeError::File { name: name.to_owned(), why };
        let file: File = serde_json::from_str(text).map_err(|error| wrong(error.to_string()))?;
        if file.ready_made != VERSION {
            return Err(wrong(format!("version {}", file.ready_made)));
        }
        if file.vertices.iter().flatten().any(|x| !x.is_finite()) {
            return Err(wrong("coordinates that are not finite".to_owned()));
        }
        let topology = Topology::new(file.vertices.len(), file.faces).map_err(|error| wrong(error.to_string()))?;
        if topology.face_count() == 0 || boundary_loops(&topology).is_empty() {
            return Err(wrong(format!("{} triangles without an opening", topology.face_count())));
        }
        let positions = file.vertices.into_iter().map(Vec3::from_array).collect();
        Ok(Self::assemble([&file.garment, &file.gender, &file.material], positions, topology, mean))
    }

    fn assemble(
        [garment, gender, material]: [&str; 3],
        positions: Vec<Vec3>,
        topology: Topology,
        mean: &Mannequin,
    ) -> Self {
        let mut face_parts = nearest_parts(&topology, &positions, mean);
        let covers = join_legs(&topology, &positions, &mut face_parts);
        let top = boundary_loops(&topology)
            .into_iter()
            .max_by(|a, b| height(a, &positions).total_cmp(&height(b, &positions)))
            .unwrap_or_default();
        let stride = top.len().div_ceil(ANCHORS).max(1);
        let anchors = top.iter().copied().step_by(stride).collect();
        let hangs_by_itself = face_parts.iter().any(|part| matches!(part, Part::Chest | Part::Neck | Part::Head));
        let band = if hangs_by_itself { Vec::new() } else { top };
        Self {
            carrier: Carrier::new(&positions, &mean.vertices),
            mean: mean.vertices.clone(),
            garment: garment.to_owned(),
            gender: gender.to_owned(),
            material: material.to_owned(),
            positions,
            topology: Arc::new(topology),
            face_parts,
            covers,
            band,
            anchors,
        }
    }

    /// Name.
    pub fn garment(&self) -> &str {
        &self.garment
    }

    /// Whose: `female` or `male`.
    pub fn gender(&self) -> &str {
        &self.gender
    }

    /// Name of its fabric.
    pub fn material(&self) -> &str {
        &self.material
    }

    /// The mesh.
    pub fn topology(&self) -> &Arc<Topology> {
        &self.topology
    }

    /// Body part that each face lies on; all of a skirt lies on the pelvis.
    pub fn face_parts(&self) -> &[Part] {
        &self.face_parts
    }

    /// Parts that vertices meet beside those of their faces.
    pub fn covers(&self) -> &[(u32, Part)] {
        &self.covers
    }

    /// The opening around the trunk by which it is held; empty where it hangs from the shoulders.
    pub fn band(&self) -> &[u32] {
        &self.band
    }

    /// Vertices that carry anchors: along the highest opening.
    pub fn anchors(&self) -> &[u32] {
        &self.anchors
    }

    /// Mean length of an edge (m).
    pub fn edge_length(&self) -> f64 {
        let x = &self.positions;
        let edges = self.topology.edges();
        let sum: f64 =
            edges.iter().map(|edge| x[edge.vertices[0] as usize].distance(x[edge.vertices[1] as usize])).sum();
        sum / edges.len().max(1) as f64
    }

    /// The vertices on the mean body (m).
    pub fn on_mean(&self) -> &[Vec3] {
        &self.positions
    }

    /// Made to measure: the mesh (m) as it goes with the surface from the mean body to another.
    pub fn made_for(&self, body: &Mannequin) -> Vec<Vec3> {
        self.carrier.carry(&self.topology, &self.positions, &self.mean, &body.vertices)
    }

    /// The physics of the garment made for a body: edges as long and folds as sharp as in the mesh.
    ///
    /// # Errors
    /// [`DressError`] where a triangle lost its area on the way to this body.
    pub fn model(&self, body: &Mannequin, fabric: &Fabric) -> Result<ClothModel, DressError> {
        let x = self.made_for(body);
        let mut model = ClothModel::new(Arc::clone(&self.topology), laid_flat(&self.topology, &x), fabric)?;
        let angle = |hinge: &crate::energy::Hinge| {
            let bend = hinge.slope_jump(&x).dot(hinge.normal(&x));
            2.0 * (0.5 * bend).clamp(-1.0, 1.0).asin()
        };
        let angles: Vec<f64> = model.hinges().iter().map(angle).collect();
        model.set_rest_angles(&angles)?;
        Ok(model)
    }

    /// Rest shape of each face on a body in panel space (m).
    pub fn rest_faces(&self, body: &Mannequin) -> Vec<[Vec2; 3]> {
        laid_flat(&self.topology, &self.made_for(body))
    }

    /// Texture coordinates of the corners of each face: the front in the left half, the back in the right.
    pub fn uv(&self) -> Vec<[[f32; 2]; 3]> {
        let x = &self.positions;
        let (low, high) = modiste_core::bounds(x).unwrap_or((Vec3::ZERO, Vec3::ONE));
        let size = (high - low).max(Vec3::splat(1e-6));
        let normals = face_normals(&self.topology, x);
        let corner = |p: Vec3, is_front: bool| {
            let across = (p.x - low.x) / size.x;
            let u = if is_front { 0.5 * across } else { 1.0 - 0.5 * across };
            [u as f32, (1.0 - (p.y - low.y) / size.y) as f32]
        };
        let faces = self.topology.faces().iter().zip(&normals);
        faces.map(|(face, normal)| face.map(|v| corner(x[v as usize], normal.z >= 0.0))).collect()
    }
}

/// The triangles of a mesh (m) laid flat one by one (m): x level, y up along the cloth.
fn laid_flat(topology: &Topology, x: &[Vec3]) -> Vec<[Vec2; 3]> {
    let flat = |face: &[u32; 3]| {
        let [a, b, c] = face.map(|v| x[v as usize]);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let level = Vec3::Y.cross(normal).try_normalize().unwrap_or(Vec3::X);
        let up = normal.cross(level);
        [a, b, c].map(|p| Vec2::new((p - a).dot(level), (p - a).dot(up)))
    };
    topology.faces().iter().map(flat).collect()
}

/// Vertices in one place joined, unused ones and triangles that have become edges left out: the vertices that stay, and the
/// triangles over them.
fn welded(vertices: &[Vec3], triangles: &[[u32; 3]]) -> (Vec<u32>, Vec<[u32; 3]>) {
    let key = |x: Vec3| (x / WELD).round().to_array().map(|x| x as i64);
    let (mut places, mut kept) = (BTreeMap::new(), Vec::new());
    let mut place = |vertex: u32| {
        *places.entry(key(vertices[vertex as usize])).or_insert_with(|| {
            kept.push(vertex);
            kept.len() as u32 - 1
        })
    };
    let faces: Vec<[u32; 3]> = triangles.iter().map(|face| face.map(&mut place)).collect();
    (kept, faces.into_iter().filter(|[a, b, c]| a != b && b != c && c != a).collect())
}

/// A vertex in which the rim meets itself: more than two of its edges are at it.
fn touching(topology: &Topology) -> Option<usize> {
    let mut rims = vec![0; topology.vertex_count()];
    for edge in topology.edges().iter().filter(|edge| edge.faces.contains(&None)) {
        edge.vertices.iter().for_each(|&vertex| rims[vertex as usize] += 1);
    }
    rims.iter().position(|&count| count > 2)
}

/// The triangle with the least area, and that area.
fn flattest(vertices: &[Vec3], faces: &[[u32; 3]]) -> Option<(usize, f64)> {
    let area = |face: &[u32; 3]| {
        let [a, b, c] = face.map(|v| vertices[v as usize]);
        0.5 * (b - a).cross(c - a).length()
    };
    faces.iter().map(area).enumerate().min_by(|a, b| a.1.total_cmp(&b.1))
}

/// The faces turned so that neighbours look the same way.
///
/// # Errors
/// An edge with three faces, or a surface with only one side.
fn oriented(faces: &[[u32; 3]]) -> Result<Vec<[u32; 3]>, String> {
    let edges = |face: [u32; 3]| [0, 1, 2].map(|corner| [face[corner], face[(corner + 1) % 3]]);
    let key = |[a, b]: [u32; 2]| [a.min(b), a.max(b)];
    let mut at_edge: BTreeMap<[u32; 2], Vec<usize>> = BTreeMap::new();
    for (index, &face) in faces.iter().enumerate() {
        edges(face).into_iter().for_each(|edge| at_edge.entry(key(edge)).or_default().push(index));
    }
    if let Some((edge, at)) = at_edge.iter().find(|(_, at)| at.len() > 2) {
        return Err(format!("{} triangles at one edge (triangles {at:?}, vertices {edge:?})", at.len()));
    }
    let mut turned: Vec<Option<[u32; 3]>> = vec![None; faces.len()];
    for first in 0..faces.len() {
        let mut open = if turned[first].is_none() { vec![first] } else { Vec::new() };
        turned[first] = turned[first].or(Some(faces[first]));
        while let Some(index) = open.pop() {
            let Some(face) = turned[index] else { continue };
            for edge in edges(face) {
                for &other in at_edge[&key(edge)].iter().filter(|&&other| other != index) {
                    let is_alike = |face: [u32; 3]| edges(face).contains(&[edge[1], edge[0]]);
                    match turned[other] {
                        Some(face) if is_alike(face) => {}
                        Some(_) => return Err(format!("a surface with one side only, at triangle {other}")),
                        None => {
                            let [a, b, c] = faces[other];
                            turned[other] = Some(if is_alike([a, b, c]) { [a, b, c] } else { [a, c, b] });
                            open.push(other);
                        }
                    }
                }
            }
        }
    }
    Ok(turned.into_iter().flatten().collect())
}

fn check_place(name: &str, vertices: &[Vec3], body: &Mannequin, tree: &TriangleBvh) -> Result<(), ReadyMadeError> {
    let mut distances: Vec<f64> = vertices
        .iter()
        .map(|&x| tree.closest_point(&body.vertices, x, f64::INFINITY).map_or(f64::INFINITY, |near| near.distance))
        .collect();
    let deep = vertices.iter().zip(&distances).filter(|&(x, &d)| d > DEEP && tree.contains(&body.vertices, *x)).count();
    let share = deep as f64 / vertices.len() as f64;
    if share > MOST_INSIDE {
        return Err(ReadyMadeError::Inside { name: name.to_owned(), share: 100.0 * share });
    }
    distances.sort_by(f64::total_cmp);
    let distance = distances[distances.len() / 2];
    if distance > FARTHEST_MEDIAN {
        return Err(ReadyMadeError::Away { name: name.to_owned(), distance });
    }
    Ok(())
}

/// Whether more of the surface looks at the body than away from it.
fn is_inside_out(topology: &Topology, x: &[Vec3], body: &Mannequin, tree: &TriangleBvh) -> bool {
    let normals = face_normals(topology, x);
    let areas = face_areas(topology, x);
    let body_normals = face_normals(&body.topology, &body.vertices);
    let outward: f64 = topology
        .faces()
        .iter()
        .enumerate()
        .filter_map(|(face, corners)| {
            let centre = corners.iter().map(|&v| x[v as usize]).sum::<Vec3>() / 3.0;
            let near = tree.closest_point(&body.vertices, centre, 0.5)?;
            Some(areas[face] * normals[face].dot(body_normals[near.face as usize]).signum())
        })
        .sum();
    outward < 0.0
}

fn height(vertices: &[u32], x: &[Vec3]) -> f64 {
    vertices.iter().map(|&v| x[v as usize].y).sum::<f64>() / vertices.len().max(1) as f64
}

/// The part of the body nearest to each face, single faces following their neighbours.
fn nearest_parts(topology: &Topology, x: &[Vec3], body: &Mannequin) -> Vec<Part> {
    let tree = TriangleBvh::new(&body.topology, &body.vertices);
    let nearest = |corners: &[u32; 3]| {
        let centre = corners.iter().map(|&v| x[v as usize]).sum::<Vec3>() / 3.0;
        let near = tree.closest_point(&body.vertices, centre, f64::INFINITY);
        near.map_or(Part::Pelvis, |near| body.face_parts[near.face as usize])
    };
    let mut parts: Vec<Part> = topology.faces().iter().map(nearest).collect();
    let mut around: Vec<Vec<u32>> = vec![Vec::new(); parts.len()];
    for edge in topology.edges() {
        if let [Some(a), Some(b)] = edge.faces {
            around[a as usize].push(b);
            around[b as usize].push(a);
        }
    }
    for _ in 0..PART_ROUNDS {
        let vote = |face: usize| {
            let others = around[face].iter().map(|&other| parts[other as usize]);
            let count = |part: Part| others.clone().filter(|&other| other == part).count();
            // Two neighbours outvote the face itself.
            others.clone().find(|&part| part != parts[face] && count(part) >= 2).unwrap_or(parts[face])
        };
        parts = (0..parts.len()).map(vote).collect();
    }
    parts
}

/// Where an opening goes around both legs, all that lies on the legs hangs from the pelvis and meets either leg.
fn join_legs(topology: &Topology, x: &[Vec3], parts: &mut [Part]) -> Vec<(u32, Part)> {
    const LEFT: [Part; 3] = [Part::LeftThigh, Part::LeftShin, Part::LeftFoot];
    const RIGHT: [Part; 3] = [Part::RightThigh, Part::RightShin, Part::RightFoot];
    const MET: [Part; 4] = [Part::LeftThigh, Part::RightThigh, Part::LeftShin, Part::RightShin];
    let loops = boundary_loops(topology);
    let Some(lowest) = loops.iter().min_by(|a, b| height(a, x).total_cmp(&height(b, x))) else { return Vec::new() };
    let touches = |leg: &[Part; 3]| {
        lowest.iter().any(|&v| topology.vertex_faces(v as usize).iter().any(|&f| leg.contains(&parts[f as usize])))
    };
    if !(touches(&LEFT) && touches(&RIGHT)) {
        return Vec::new();
    }
    let mut covers = Vec::new();
    for (face, corners) in topology.faces().iter().enumerate() {
        if !(LEFT.contains(&parts[face]) || RIGHT.contains(&parts[face])) {
            continue;
        }
        parts[face] = Part::Pelvis;
        covers.extend(corners.iter().flat_map(|&vertex| MET.map(|part| (vertex, part))));
    }
    covers.sort_unstable_by_key(|&(vertex, part)| (vertex, part.index()));
    covers.dedup();
    covers
}

#[cfg(test)]
mod tests {
    use super::{ReadyMade, ReadyMadeError};
    use crate::Fabric;
    use crate::dress::dummy::dummy;
    use crate::dress::{Carrier, Design, Tailor, TailorOptions};
    use modiste_body::{Gender, Part};
    use modiste_core::{Vec3, boundary_loops};
    use std::sync::Arc;

    const SIDES: u32 = 40;

    /// A skirt: a cone around the hips of the dummy from the waist to above the knees, facing outward.
    fn skirt() -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let rows = 16;
        let (mut x, mut faces) = (Vec::new(), Vec::new());
        for row in 0..=rows {
            let t = f64::from(row) / f64::from(rows);
            for side in 0..SIDES {
                let angle = std::f64::consts::TAU * f64::from(side) / f64::from(SIDES);
                let [wide, deep] = [0.155, 0.12].map(|r: f64| r + 0.005 + 0.10 * t);
                x.push(Vec3::new(wide * angle.sin(), 1.02 - 0.42 * t, deep * angle.cos()));
                if row < rows {
                    let id = |row: u32, side: u32| row * SIDES + side % SIDES;
                    let [a, b, c, d] = [id(row, side), id(row, side + 1), id(row + 1, side + 1), id(row + 1, side)];
                    faces.extend([[a, d, c], [a, c, b]]);
                }
            }
        }
        (x, faces)
    }

    fn made(x: &[Vec3], faces: &[[u32; 3]]) -> Result<ReadyMade, ReadyMadeError> {
        ReadyMade::new(("skirt", Gender::Female, "jersey"), x, faces, &dummy(1.0), &dummy(1.0))
    }

    #[test]
    fn a_skirt_hangs_from_its_waist_and_meets_both_legs() {
        let (x, faces) = skirt();
        let skirt = made(&x, &faces).unwrap();
        assert!(skirt.face_parts().iter().all(|part| matches!(part, Part::Pelvis | Part::Abdomen)));
        let on_mean = skirt.on_mean();
        assert_eq!(skirt.band().len(), SIDES as usize);
        assert!(skirt.band().iter().all(|&v| on_mean[v as usize].y > 1.01), "the upper opening");
        assert!(skirt.anchors().len() >= 20 && skirt.anchors().iter().all(|v| skirt.band().contains(v)));
        let hem = boundary_loops(skirt.topology()).into_iter().find(|ring| on_mean[ring[0] as usize].y < 0.7).unwrap();
        for part in [Part::LeftThigh, Part::RightThigh] {
            assert!(hem.iter().all(|&v| skirt.covers().contains(&(v, part))), "the hem may meet either leg");
        }
    }

    #[test]
    fn the_mesh_is_its_own_rest_shape_on_every_body() {
        let (x, faces) = skirt();
        let skirt = made(&x, &faces).unwrap();
        for body in [dummy(1.0), dummy(1.15)] {
            let model = skirt.model(&body, &Fabric::denim()).unwrap();
            let fitted = skirt.made_for(&body);
            assert!(model.energy(&fitted, Vec3::ZERO) < 1e-9, "{}", model.energy(&fitted, Vec3::ZERO));
            let flatter: Vec<Vec3> = fitted.iter().map(|x| Vec3::new(x.x, x.y, 0.9 * x.z)).collect();
            assert!(model.energy(&flatter, Vec3::ZERO) > 1e-4);
        }
        let width = |x: &[Vec3]| x.iter().map(|x| x.x).fold(0.0, f64::max);
        assert!(width(&skirt.made_for(&dummy(1.15))) > width(skirt.on_mean()) + 0.01, "wider on a wider body");
    }

    #[test]
    fn what_is_stored_is_read_back_and_what_is_not_one_is_refused() {
        let (x, faces) = skirt();
        let skirt = made(&x, &faces).unwrap();
        let text = skirt.to_json();
        assert!(ReadyMade::is_one(&text));
        let again = ReadyMade::from_json("skirt", &text, &dummy(1.0)).unwrap();
        assert!(again.on_mean().iter().zip(skirt.on_mean()).all(|(a, b)| a.distance(*b) < 1e-12));
        assert_eq!(again.face_parts(), skirt.face_parts());
        assert_eq!((again.band(), again.covers()), (skirt.band(), skirt.covers()));
        for (from, to) in [
            ("\"ready_made\":1", "\"ready_made\":2"),
            ("[[", "[[1e999,0,0],["),
            ("[[0,", "[[9999,"),
            ("\"faces\":[[", "\"faces\":[],\"old\":[["),
            ("}", ""),
        ] {
            assert!(text.contains(from));
            let error = ReadyMade::from_json("file", &text.replacen(from, to, 1), &dummy(1.0)).unwrap_err();
            assert!(error.to_string().starts_with("file"), "{error}");
        }
    }

    #[test]
    fn a_mesh_that_faces_inward_or_has_split_vertices_is_mended() {
        let (x, faces) = skirt();
        let wanted = made(&x, &faces).unwrap();
        let inward: Vec<[u32; 3]> = faces.iter().map(|&[a, b, c]| [a, c, b]).collect();
        let volume = |garment: &ReadyMade| modiste_core::volume(garment.topology(), garment.on_mean());
        assert!((volume(&made(&x, &inward).unwrap()) - volume(&wanted)).abs() < 1e-9, "turned");
        let mixed: Vec<[u32; 3]> =
            faces.iter().enumerate().map(|(f, &[a, b, c])| if f % 7 == 3 { [a, c, b] } else { [a, b, c] }).collect();
        assert!((volume(&made(&x, &mixed).unwrap()) - volume(&wanted)).abs() < 1e-9, "turned one by one");
        let split: Vec<Vec3> = faces.as_flattened().iter().map(|&v| x[v as usize]).collect();
        let corners: Vec<[u32; 3]> = (0..faces.len() as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect();
        assert_eq!(made(&split, &corners).unwrap().on_mean().len(), x.len());
    }

    #[test]
    fn meshes_that_nobody_can_wear_are_refused_with_the_reason() {
        let (x, faces) = skirt();
        let refused = |x: &[Vec3], faces: &[[u32; 3]], wanted: &str| {
            let error = made(x, faces).err().map(|error| error.to_string()).unwrap_or_default();
            assert!(error.contains(wanted), "{wanted}: {error}");
        };
        refused(&x, &[], "found none");
        refused(&x, &[[0, 1, 9999]], "vertex 9999");
        refused(&x, &vec![faces[0]; 60_001], "at most 60000");
        let [a, b, _] = faces[0];
        refused(&x, &[faces.clone(), vec![[a, b, 300]]].concat(), "3 triangles at one edge");
        let flap = [x.clone(), vec![Vec3::new(0.3, 1.1, 0.2), Vec3::new(0.2, 1.1, 0.3)]].concat();
        let end = x.len() as u32;
        refused(&flap, &[faces.clone(), vec![[0, end, end + 1]]].concat(), "touch in vertex 0 alone");
        let away: Vec<Vec3> = x.iter().map(|x| *x + Vec3::new(1.5, 0.0, 0.0)).collect();
        refused(&away, &faces, "m away from it");
        let inside: Vec<Vec3> = x.iter().map(|x| Vec3::new(0.2 * x.x, x.y, 0.2 * x.z)).collect();
        refused(&inside, &faces, "inside");
        let mut flat = x.clone();
        flat[0] = 0.5 * (x[1] + x[SIDES as usize + 1]);
        refused(&flat, &faces, "triangles with area");
        let moved: Vec<Vec3> = x.iter().map(|x| *x + Vec3::new(0.0, -0.05, 0.0)).collect();
        let both: Vec<Vec3> = x.iter().chain(&moved).copied().collect();
        let second: Vec<[u32; 3]> = faces.iter().map(|face| face.map(|v| v + x.len() as u32)).collect();
        refused(&both, &[faces.clone(), second].concat(), "2 pieces");
        let ball = modiste_core::shapes::icosphere(2);
        let around: Vec<Vec3> = ball.vertices.iter().map(|v| 0.3 * *v + Vec3::new(0.0, 0.95, 0.0)).collect();
        refused(&around, ball.topology.faces(), "without openings");
    }

    #[test]
    fn a_skirt_is_laid_on_carried_and_comes_to_rest() {
        let (x, faces) = skirt();
        let design = Design::ReadyMade(Arc::new(made(&x, &faces).unwrap()));
        let tailor = Tailor::new(design, TailorOptions::default()).unwrap();
        let (body, wider) = (dummy(1.0), dummy(1.1));
        let dressed = tailor.dress(&body).unwrap();
        assert!(dressed.quality.stretch < 0.06, "{:?}", dressed.quality);
        let moved = dressed.state.positions.iter().zip(&x).map(|(a, b)| a.distance(*b)).sum::<f64>() / x.len() as f64;
        assert!(moved < 0.06, "it keeps its shape: {moved}");
        let carrier = Carrier::new(&dressed.state.positions, &body.vertices);
        let carried = tailor.redress(&carrier, &dressed, &body, (&wider, 0.0)).unwrap();
        assert!(carried.quality.stretch < 0.06, "{:?}", carried.quality);
    }
}
