//! Rigs and skin weights.

use std::collections::BTreeMap;

use serde::Deserialize;

use super::{BASE_VERTEX_COUNT, VertexGroups};
use crate::{IoError, json};

/// For each bone, the vertices it moves and their weights.
pub type SkinWeights = BTreeMap<String, Vec<(u32, f64)>>;

/// A bone, whose ends are means of base vertices and so move with the targets.
#[derive(Debug, Clone, PartialEq)]
pub struct Bone {
    /// Name.
    pub name: String,
    /// Index of the parent bone, always before this one.
    pub parent: Option<usize>,
    /// The joint lies at the mean of these base vertices (a joint cube, one vertex or several).
    pub head: Vec<u32>,
    /// The tip lies at the mean of these base vertices.
    pub tail: Vec<u32>,
    /// Rotation about the bone's own axis (rad), in Blender's meaning.
    pub roll: f64,
}

#[derive(Deserialize)]
struct RawBone {
    parent: String,
    head: RawEnd,
    tail: RawEnd,
    roll: f64,
}

#[derive(Deserialize)]
#[serde(tag = "strategy")]
enum RawEnd {
    #[serde(rename = "CUBE")]
    Cube { cube_name: String },
    #[serde(rename = "VERTEX")]
    Vertex { vertex_index: u32 },
    #[serde(rename = "MEAN")]
    Mean { vertex_indices: Vec<u32> },
}

#[derive(Deserialize)]
struct RawWeights {
    weights: SkinWeights,
}

/// Reads a rig; joint cubes are looked up in `groups`.
pub(super) fn parse(bytes: &[u8], groups: &VertexGroups, name: &str) -> Result<Vec<Bone>, IoError> {
    let raw: BTreeMap<String, RawBone> = json::parse(bytes, name)?;
    let vertices = |bone: &str, end: &RawEnd| {
        let wrong = |wanted: &str, found: String| IoError::field(name, format!("bone \"{bone}\""), wanted, found);
        let vertices = match end {
            RawEnd::Vertex { vertex_index } => vec![*vertex_index],
            RawEnd::Mean { vertex_indices } => vertex_indices.clone(),
            RawEnd::Cube { cube_name } => {
                let ranges =
                    groups.get(cube_name).ok_or_else(|| wrong("a joint cube that exists", cube_name.clone()))?;
                ranges.iter().flat_map(|range| range[0]..=range[1]).collect()
            }
        };
        match vertices.iter().find(|vertex| **vertex as usize >= BASE_VERTEX_COUNT) {
            Some(vertex) => Err(wrong("vertices of the base mesh", vertex.to_string())),
            None if vertices.is_empty() => Err(wrong("at least one vertex at each end", "none".to_owned())),
            None => Ok(vertices),
        }
    };
    let mut bones: Vec<Bone> = Vec::with_capacity(raw.len());
    let mut index_of: BTreeMap<&str, usize> = BTreeMap::new();
    while bones.len() < raw.len() {
        let before = bones.len();
        for (bone, data) in &raw {
            let parent = if data.parent.is_empty() { None } else { index_of.get(data.parent.as_str()).copied() };
            let parent_known = parent.is_some() || data.parent.is_empty();
            if index_of.contains_key(bone.as_str()) || !parent_known {
                continue;
            }
            index_of.insert(bone, bones.len());
            let (head, tail) = (vertices(bone, &data.head)?, vertices(bone, &data.tail)?);
            bones.push(Bone { name: bone.clone(), parent, head, tail, roll: data.roll });
        }
        if bones.len() == before {
            let orphan = raw.keys().find(|bone| !index_of.contains_key(bone.as_str()));
            let field = format!("bone \"{}\"", orphan.map_or("", String::as_str));
            return Err(IoError::field(name, field, "a chain of parents up to a root", "a missing parent or a loop"));
        }
    }
    Ok(bones)
}

/// Reads skin weights.
pub(super) fn parse_weights(bytes: &[u8], name: &str) -> Result<SkinWeights, IoError> {
    let RawWeights { weights } = json::parse(bytes, name)?;
    for (bone, pairs) in &weights {
        if let Some((vertex, weight)) =
            pairs.iter().find(|(vertex, weight)| *vertex as usize >= BASE_VERTEX_COUNT || !(0.0..=1.0).contains(weight))
        {
            let wanted = format!("vertices below {BASE_VERTEX_COUNT} with weights from 0 to 1");
            return Err(IoError::field(name, format!("bone \"{bone}\""), wanted, format!("[{vertex}, {weight}]")));
        }
    }
    Ok(weights)
}

#[cfg(test)]
mod tests {
    use super::{parse, parse_weights};
    use crate::fuzz::survives_damage;
    use crate::makehuman::VertexGroups;

    const RIG: &str = r#"{
        "arm": {"head": {"strategy": "CUBE", "cube_name": "joint", "default_position": [0, 0, 0]}, "tail": {"strategy": "VERTEX", "vertex_index": 9}, "parent": "root", "roll": 0.5},
        "root": {"head": {"strategy": "MEAN", "vertex_indices": [1, 2]}, "tail": {"strategy": "CUBE", "cube_name": "joint"}, "parent": "", "roll": 0.0}}"#;

    fn groups() -> VertexGroups {
        VertexGroups::from([("joint".to_owned(), vec![[3, 5], [8, 8]])])
    }

    #[test]
    fn parents_come_first_and_ends_are_vertices() {
        let bones = parse(RIG.as_bytes(), &groups(), "rig").unwrap();
        assert_eq!((bones[0].name.as_str(), bones[0].parent), ("root", None));
        assert_eq!((bones[1].name.as_str(), bones[1].parent), ("arm", Some(0)));
        assert_eq!((bones[1].head.as_slice(), bones[1].tail.as_slice()), (&[3, 4, 5, 8][..], &[9][..]));
        assert_eq!(bones[0].head, [1, 2]);
    }

    #[test]
    fn errors_name_the_bone() {
        let message = |from: &str, to: &str| {
            parse(RIG.replacen(from, to, 1).as_bytes(), &groups(), "rig").unwrap_err().to_string()
        };
        assert!(message("\"parent\": \"\"", "\"parent\": \"arm\"").contains("a missing parent or a loop"));
        assert!(message(": 9}", ": 19158}").contains("bone \"arm\": wanted vertices of the base mesh, found 19158"));
        assert!(message("\"joint\"", "\"knee\"").contains("found knee"));
        assert!(message("[1, 2]", "[]").contains("at least one vertex"));
        assert!(message("MEAN", "XYZ").contains("XYZ"));
        let weights = parse_weights(br#"{"weights": {"a": [[1, 0.5], [2, 1.5]]}}"#, "w").unwrap_err().to_string();
        assert!(weights.contains("bone \"a\"") && weights.contains("[2, 1.5]"), "{weights}");
    }

    #[test]
    fn damage_never_panics() {
        survives_damage(RIG.as_bytes(), |bytes| drop(parse(bytes, &groups(), "damaged")));
        survives_damage(br#"{"weights": {"a": [[1, 0.5]]}}"#, |bytes| drop(parse_weights(bytes, "damaged")));
    }
}
