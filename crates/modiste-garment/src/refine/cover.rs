//! How thick the garments worn below lie on a body.

use modiste_core::{Topology, Vec3};

use super::contact::Contact;
use super::obstacle::Obstacle;

/// Cloth further from the body than this (m) does not raise it: what hangs free is not lain upon.
const HIGHEST: f64 = 0.06;

/// What it counts for all the same (m), so that one knows where cloth is.
const HANGING: f64 = 1e-9;

/// How steeply the height falls off beyond the edge of a garment.
const SLOPE: f64 = 0.25;

/// Rings of vertices over which it falls off.
const RINGS: usize = 5;

/// Heights over the vertices of a body (m) under which an outer garment must not go.
///
/// Seen from an outer garment the body is that much thicker. Unlike the inner garment itself this surface has no edge:
/// beyond a waist band it falls off gently, and the cloth over it with it.
#[derive(Debug, Clone, Default)]
pub(crate) struct Cover {
    heights: Vec<f64>,
    rim: Vec<u32>,
    next: Vec<u32>,
}

impl Cover {
    /// Takes all cloth away.
    pub(crate) fn clear(&mut self) {
        self.heights.clear();
    }

    /// Lays points of cloth on a body, by their contacts; `thickness` (m) is added. Around them the height falls off. What
    /// cloth passes by, as trousers do a hanging hand, it does not lie on: leave those contacts out.
    pub(crate) fn lay<'a>(
        &mut self,
        body: &Topology,
        vertices: &[Vec3],
        contacts: impl Iterator<Item = &'a Contact>,
        thickness: f64,
    ) {
        self.heights.resize(vertices.len(), 0.0);
        self.rim.clear();
        contacts.for_each(|contact| self.lay_point(body, contact, thickness));
        self.spread(body, vertices);
    }

    fn lay_point(&mut self, body: &Topology, contact: &Contact, thickness: f64) {
        let height = contact.distance + contact.raised + thickness;
        if contact.pinched {
            return;
        }
        let height = if height > HIGHEST { HANGING } else { height };
        for vertex in body.faces()[contact.face as usize] {
            let found = &mut self.heights[vertex as usize];
            if height > *found {
                *found = height;
                self.rim.push(vertex);
            }
        }
    }

    /// Lets the height fall off around the cloth that was laid.
    fn spread(&mut self, body: &Topology, vertices: &[Vec3]) {
        let Self { heights, rim, next, .. } = self;
        rim.sort_unstable();
        rim.dedup();
        for _ in 0..RINGS {
            next.clear();
            for &vertex in rim.iter() {
                for &other in body.neighbours(vertex as usize) {
                    let fall = SLOPE * vertices[vertex as usize].distance(vertices[other as usize]);
                    let height = heights[vertex as usize] - fall;
                    if height > heights[other as usize] {
                        heights[other as usize] = height;
                        next.push(other);
                    }
                }
            }
            next.sort_unstable();
            next.dedup();
            std::mem::swap(rim, next);
        }
    }

    /// Whether no cloth was laid.
    pub(crate) fn is_empty(&self) -> bool {
        self.heights.is_empty()
    }

    fn height(&self, vertex: u32) -> f64 {
        self.heights[vertex as usize]
    }
}

/// A surface as a garment finds it: raised by the garments that lie on it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ground<'a> {
    pub(crate) obstacle: &'a Obstacle,
    pub(crate) cover: Option<&'a Cover>,
}

impl Ground<'_> {
    /// The contact of a point with it; see [`Obstacle::touch`].
    pub(crate) fn touch(&self, point: Vec3, reach: f64, hint: &mut u32) -> Option<Contact> {
        let mut contact = self.obstacle.touch(point, reach, hint)?;
        self.raise(&mut contact);
        Some(contact)
    }

    /// The contact of a point with the surface around a face; see [`Obstacle::contact_around`].
    pub(crate) fn touch_around(&self, point: Vec3, face: u32) -> Option<Contact> {
        let mut contact = self.obstacle.contact_around(point, face)?;
        self.raise(&mut contact);
        Some(contact)
    }

    /// Raises the surface in a contact that was found without the garments on it.
    pub(crate) fn raise(&self, contact: &mut Contact) {
        if let Some(cover) = self.cover {
            let corners = self.obstacle.topology().faces()[contact.face as usize];
            let heights = corners.iter().zip(contact.barycentric);
            contact.raised = heights.map(|(&vertex, share)| share * cover.height(vertex)).sum();
            contact.distance -= contact.raised;
        }
    }

    /// How much it is raised at a vertex (m).
    pub(crate) fn height(&self, vertex: u32) -> f64 {
        self.cover.map_or(0.0, |cover| cover.height(vertex))
    }

    /// How much it is raised at a face (m).
    pub(crate) fn height_of(&self, face: u32) -> f64 {
        let corners = self.obstacle.topology().faces()[face as usize];
        corners.into_iter().map(|vertex| self.height(vertex)).sum::<f64>() / 3.0
    }

    /// A vertex of it (m).
    pub(crate) fn vertex(&self, vertex: u32) -> Vec3 {
        let height = self.height(vertex);
        self.obstacle.vertices()[vertex as usize] + height * self.obstacle.vertex_normals()[vertex as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::{Cover, Ground, RINGS, SLOPE};
    use crate::refine::obstacle::{NO_HINT, Obstacle};
    use modiste_core::Vec3;
    use modiste_core::shapes::icosphere;

    #[test]
    fn the_ground_is_as_high_as_the_cloth_on_it_and_falls_off_beyond_its_edge() {
        let sphere = icosphere(5);
        let obstacle = Obstacle::single(sphere.topology.clone(), &sphere.vertices);
        // Cloth 3 cm over the lower half.
        let mut cover = Cover::default();
        let low = sphere.vertices.iter().filter(|v| v.y < 0.0);
        let contacts: Vec<_> = low.filter_map(|v| obstacle.contact(1.03 * *v, 1.0, &mut NO_HINT.clone())).collect();
        cover.lay(&sphere.topology, &sphere.vertices, contacts.iter(), 0.001);
        let ground = Ground { obstacle: &obstacle, cover: Some(&cover) };
        let height = |y: f64| {
            let point = Vec3::new((1.0 - y * y).sqrt(), y, 0.0) * 1.2;
            let contact = ground.touch(point, 1.0, &mut NO_HINT.clone()).unwrap();
            assert!((contact.distance + contact.raised - 0.2).abs() < 2e-3);
            contact.raised
        };
        assert!((height(-0.5) - 0.031).abs() < 1e-3);
        assert!((height(-0.01) - 0.031).abs() < 2e-3);
        let edge = 0.05;
        let (near, far) = (height(0.06), height(0.12));
        assert!((near - far - 0.06 * SLOPE).abs() < 3e-3, "{near} {far}");
        assert!(near < 0.031 && far > 0.0);
        assert!(height(edge + 2.0 * RINGS as f64 * 0.04) < 1e-12);
    }
}
