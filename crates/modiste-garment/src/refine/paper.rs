//! The interpenetration step of the paper: three iterations of one linear least-squares problem (DRAPE §5).

use modiste_core::Vec3;

use super::nearest::NearestPoints;
use super::obstacle::Obstacle;
use super::warp::{Pull, Push, Stiffness, Warp, WarpOptions};

/// Weights of the paper.
#[derive(Debug, Clone, PartialEq)]
pub struct PaperOptions {
    /// λ_s and λ_d of each iteration.
    pub iterations: Vec<Stiffness>,
    /// Weight of the tightness of the waist band, λ_t.
    pub tightness: f64,
    /// Distance outside of the body that penetrating vertices are sent to (m), -ε.
    pub clearance: f64,
    /// How the least-squares problem is solved.
    pub warp: WarpOptions,
}

impl Default for PaperOptions {
    fn default() -> Self {
        let iteration = |smooth, damping| Stiffness { smooth, damping };
        Self {
            iterations: vec![iteration(4.0, 0.8), iteration(2.0, 0.6), iteration(1.0, 0.4)],
            tightness: 0.2,
            clearance: 0.003,
            warp: WarpOptions::default(),
        }
    }
}

/// A vertex of one of several surfaces with its normal: an entry of the correspondences C.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Correspondence {
    pub(crate) point: Vec3,
    pub(crate) normal: Vec3,
}

/// The combined vertex set that a garment is compared with: some vertices of the body and all those of garments below.
#[derive(Debug, Clone, Default)]
pub(crate) struct CombinedVertices {
    clouds: Vec<NearestPoints>,
}

impl CombinedVertices {
    /// Takes in the surfaces with the vertices that count of each.
    pub(crate) fn fill(&mut self, surfaces: &[(&Obstacle, &[u32])]) {
        self.clouds.resize_with(surfaces.len(), NearestPoints::default);
        for (cloud, (surface, members)) in self.clouds.iter_mut().zip(surfaces) {
            cloud.fill(surface.vertices(), members);
        }
    }

    /// C: for each vertex of the garment the nearest of the combined vertices.
    pub(crate) fn correspond(
        &self,
        surfaces: &[(&Obstacle, &[u32])],
        garment: &[Vec3],
        out: &mut Vec<Option<Correspondence>>,
    ) {
        out.clear();
        out.extend(garment.iter().map(|&vertex| {
            let mut best: Option<(usize, u32)> = None;
            let mut limit = f64::INFINITY;
            for (surface, cloud) in self.clouds.iter().enumerate() {
                if let Some((index, distance)) = cloud.nearest(vertex, limit) {
                    limit = distance;
                    best = Some((surface, index));
                }
            }
            best.map(|(surface, index)| {
                let surface = surfaces[surface].0;
                let (point, normal) = (surface.vertices()[index as usize], surface.vertex_normals()[index as usize]);
                Correspondence { point, normal }
            })
        }));
    }
}

/// Runs the iterations; C stays as it was found. `warp` is memory for one vector a vertex.
pub(crate) fn push_out(
    solver: &mut Warp,
    options: &PaperOptions,
    correspondences: &[Option<Correspondence>],
    waist_band: &[u32],
    garment: &mut [Vec3],
    memory: &mut PaperMemory,
) {
    let PaperMemory { pushes, pulls, warp } = memory;
    warp.resize(garment.len(), Vec3::ZERO);
    for &stiffness in &options.iterations {
        pushes.clear();
        pulls.clear();
        for ((vertex, at), correspondence) in (0u32..).zip(garment.iter()).zip(correspondences) {
            let Some(Correspondence { point, normal }) = correspondence else { continue };
            let height = normal.dot(*at - *point);
            if height < 0.0 {
                pushes.push(Push { vertex, normal: *normal, gap: options.clearance - height, weight: 1.0 });
            }
        }
        for &vertex in waist_band {
            if let Some(Correspondence { point, .. }) = correspondences[vertex as usize] {
                let offset = point - garment[vertex as usize];
                pulls.push(Pull { vertex, offset, weight: options.tightness });
            }
        }
        if pushes.is_empty() && pulls.is_empty() {
            return;
        }
        solver.solve(stiffness, pushes, pulls, options.warp, warp);
        for &vertex in solver.region() {
            garment[vertex as usize] += warp[vertex as usize];
        }
    }
}

/// Memory of [`push_out`].
#[derive(Debug, Clone, Default)]
pub(crate) struct PaperMemory {
    pushes: Vec<Push>,
    pulls: Vec<Pull>,
    warp: Vec<Vec3>,
}
