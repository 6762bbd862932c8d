//! Building the tree: binned surface-area heuristic, two binary splits per node.

use super::{Child, LEAF, Node, WIDTH};
use crate::Vec3;

/// Bins per axis of the surface-area heuristic (Wald 2007).
const BINS: usize = 16;

/// A face on its way into the tree.
#[derive(Clone, Copy)]
struct Item {
    index: u32,
    low: Vec3,
    high: Vec3,
}

impl Item {
    /// Twice the centre of the box.
    fn centre(&self) -> Vec3 {
        self.low + self.high
    }
}

/// The nodes (boxes still empty) and the faces in leaf order.
pub(super) fn build(corners: &[[u32; 3]], x: &[Vec3]) -> (Vec<Node>, Vec<u32>) {
    let mut items: Vec<Item> = (0u32..)
        .zip(corners)
        .map(|(index, corners)| {
            let [a, b, c] = corners.map(|vertex| x[vertex as usize]);
            Item { index, low: a.min(b).min(c), high: a.max(b).max(c) }
        })
        .collect();
    let mut nodes = vec![Node::EMPTY];
    if !items.is_empty() {
        fill_node(&mut nodes, 0, &mut items, 0);
    }
    (nodes, items.iter().map(|item| item.index).collect())
}

/// Splits the items into up to four runs and makes them the children of a node.
fn fill_node(nodes: &mut Vec<Node>, node: usize, items: &mut [Item], first: usize) {
    // Split the largest run until there are four, or only leaves.
    let mut runs = vec![(first, items.len())];
    while runs.len() < WIDTH {
        let splittable = runs.iter().enumerate().filter(|(_, (_, count))| *count > LEAF);
        let Some((at, &(start, count))) = splittable.max_by_key(|(_, (_, count))| *count) else { break };
        let middle = split(&mut items[start - first..start - first + count]);
        runs[at] = (start, middle);
        runs.insert(at + 1, (start + middle, count - middle));
    }
    for (slot, (start, count)) in runs.into_iter().enumerate() {
        nodes[node].children[slot] = if count <= LEAF {
            Child::leaf(start, count)
        } else {
            let child = nodes.len();
            nodes.push(Node::EMPTY);
            fill_node(nodes, child, &mut items[start - first..start - first + count], start);
            Child::node(child)
        };
    }
}

/// Reorders the items into two groups that are not empty and returns the size of the first.
fn split(items: &mut [Item]) -> usize {
    let zero = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let (low, high) = items.iter().fold(zero, |(low, high), item| (low.min(item.centre()), high.max(item.centre())));
    let mut best: Option<(f64, usize, f64)> = None;
    for axis in 0..3 {
        let (start, extent) = (low[axis], high[axis] - low[axis]);
        if extent <= 0.0 || extent.is_nan() {
            continue;
        }
        let bin = |item: &Item| (((item.centre()[axis] - start) / extent * BINS as f64) as usize).min(BINS - 1);
        let mut bins = [(0usize, Vec3::INFINITY, Vec3::NEG_INFINITY); BINS];
        for item in items.iter() {
            let (count, low, high) = &mut bins[bin(item)];
            *count += 1;
            *low = low.min(item.low);
            *high = high.max(item.high);
        }
        let mut cost_left = [0.0; BINS];
        let mut group = (0usize, zero.0, zero.1);
        for boundary in 1..BINS {
            group = joined(group, bins[boundary - 1]);
            cost_left[boundary] = cost(group);
        }
        let mut group = (0usize, zero.0, zero.1);
        for boundary in (1..BINS).rev() {
            group = joined(group, bins[boundary]);
            let both_used = group.0 > 0 && group.0 < items.len();
            let total = cost_left[boundary] + cost(group);
            if both_used && best.is_none_or(|(least, ..)| total < least) {
                best = Some((total, axis, start + extent * boundary as f64 / BINS as f64));
            }
        }
    }
    let middle = items.len() / 2;
    if let Some((_, axis, boundary)) = best {
        items.sort_by(|a, b| (a.centre()[axis] >= boundary).cmp(&(b.centre()[axis] >= boundary)));
        let count = items.partition_point(|item| item.centre()[axis] < boundary);
        // Very uneven splits would make the tree deep.
        if 6 * count.min(items.len() - count) >= items.len() {
            return count;
        }
        items.select_nth_unstable_by(middle, |a, b| {
            a.centre()[axis].total_cmp(&b.centre()[axis]).then(a.index.cmp(&b.index))
        });
    }
    middle
}

type Group = (usize, Vec3, Vec3);

fn joined(a: Group, b: Group) -> Group {
    (a.0 + b.0, a.1.min(b.1), a.2.max(b.2))
}

/// Number of faces times half the surface of their box.
fn cost((count, low, high): Group) -> f64 {
    if count == 0 {
        return 0.0;
    }
    let size = high - low;
    count as f64 * (size.x * size.y + size.y * size.z + size.z * size.x)
}
