//! The part of a garment that a warp moves.

use modiste_core::Topology;

/// The vertices that are pushed or pulled, and some rings around them.
///
/// What is solved for lies close together: the vertices are numbered anew, first those that are pushed or pulled, then the
/// rest of the region, then the ring around it, where a warp of the region bends the cloth.
#[derive(Debug, Clone, Default)]
pub(crate) struct Region {
    members: Vec<u32>,
    ring: Vec<u32>,
    /// Where each vertex is.
    sides: Vec<Side>,
    /// How many are pushed or pulled.
    constrained: usize,
    /// The new number of each vertex of region and ring.
    places: Vec<u32>,
    /// The vertices of region and ring by their new numbers.
    vertices: Vec<u32>,
    /// Where the neighbours of each begin, and the end of the last.
    starts: Vec<u32>,
    /// Neighbours in region and ring, by their new numbers.
    neighbours: Vec<u32>,
}

/// Where a vertex is.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
enum Side {
    #[default]
    Outside,
    Constrained,
    Region,
    Ring,
}

impl Region {
    pub(crate) fn new(vertex_count: usize) -> Self {
        Self { sides: vec![Side::Outside; vertex_count], places: vec![0; vertex_count], ..Self::default() }
    }

    /// The vertices that may move, ascending.
    pub(crate) fn members(&self) -> &[u32] {
        &self.members
    }

    /// How many of them are pushed or pulled; these have the first numbers.
    pub(crate) fn constrained(&self) -> usize {
        self.constrained
    }

    /// The vertices of region and ring by their new numbers.
    pub(crate) fn vertices(&self) -> &[u32] {
        &self.vertices
    }

    /// The new number of a vertex.
    pub(crate) fn place(&self, vertex: u32) -> usize {
        self.places[vertex as usize] as usize
    }

    /// Where the neighbours of each vertex begin, and the end of the last; and the neighbours.
    pub(crate) fn adjacency(&self) -> (&[u32], &[u32]) {
        (&self.starts, &self.neighbours)
    }

    /// Grows `rings` of vertices around those that are constrained.
    pub(crate) fn grow(&mut self, topology: &Topology, constrained: impl Iterator<Item = u32>, rings: usize) {
        let Self { members, ring, sides, vertices, .. } = self;
        members.clear();
        ring.clear();
        sides.fill(Side::Outside);
        let mut add = |vertex: u32, side: Side, list: &mut Vec<u32>| {
            if sides[vertex as usize] == Side::Outside {
                sides[vertex as usize] = side;
                list.push(vertex);
            }
        };
        constrained.for_each(|vertex| add(vertex, Side::Constrained, members));
        let mut last = 0;
        for _ in 0..rings {
            let end = members.len();
            for index in last..end {
                for &neighbour in topology.neighbours(members[index] as usize) {
                    add(neighbour, Side::Region, members);
                }
            }
            last = end;
        }
        for &vertex in &members[last..] {
            for &neighbour in topology.neighbours(vertex as usize) {
                add(neighbour, Side::Ring, ring);
            }
        }
        // In order of the vertices, memory is read in order.
        members.clear();
        ring.clear();
        vertices.clear();
        for (vertex, side) in (0u32..).zip(&*sides) {
            match side {
                Side::Outside => {}
                Side::Constrained => {
                    members.push(vertex);
                    vertices.push(vertex);
                }
                Side::Region => members.push(vertex),
                Side::Ring => ring.push(vertex),
            }
        }
        self.constrained = vertices.len();
        vertices.extend(members.iter().filter(|&&vertex| sides[vertex as usize] == Side::Region));
        vertices.extend(&*ring);
        self.number(topology);
    }

    /// Notes who is next to whom by the new numbers.
    fn number(&mut self, topology: &Topology) {
        let Self { sides, places, vertices, starts, neighbours, .. } = self;
        vertices.iter().zip(0u32..).for_each(|(&vertex, place)| places[vertex as usize] = place);
        neighbours.clear();
        starts.clear();
        starts.push(0);
        for &vertex in &*vertices {
            let around = topology.neighbours(vertex as usize).iter().map(|&other| other as usize);
            // Nothing moves in the ring, so its vertices need not know of each other.
            let is_ring = sides[vertex as usize] == Side::Ring;
            let counts = |other: &usize| match sides[*other] {
                Side::Outside => false,
                Side::Ring => !is_ring,
                Side::Constrained | Side::Region => true,
            };
            neighbours.extend(around.filter(counts).map(|other| places[other]));
            starts.push(neighbours.len() as u32);
        }
    }
}
