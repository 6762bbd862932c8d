//! The glTF scene description and the binary pieces it refers to.

use std::collections::BTreeMap;

use gltf_json::accessor::{ComponentType, GenericComponentType, Type};
use gltf_json::animation::{Channel, Interpolation, Property, Sampler};
use gltf_json::buffer::{Target as BufferTarget, View};
use gltf_json::material::{PbrBaseColorFactor, PbrMetallicRoughness, StrengthFactor};
use gltf_json::mesh::{Mode, MorphTarget, Primitive, Semantic};
use gltf_json::scene::UnitQuaternion;
use gltf_json::validation::{Checked::Valid, USize64};
use gltf_json::{Accessor, Animation, Buffer, Index, Material, Mesh, Node, Root, Scene, Skin};

use super::morph::Target;
use super::skeleton::{Influences, Skeleton};
use super::{AnimatedMesh, CodedMesh};

/// What carries the moving meshes through space, as arrays for the file.
pub(super) struct Carrier {
    /// Translation (m) of the parent node in each frame; empty if there are joints.
    translations: Vec<[f32; 3]>,
    joints: Vec<Joint>,
    /// From the rest shape to the frame of each joint, column by column.
    inverse_binds: Vec<[f32; 16]>,
}

struct Joint {
    rotations: Vec<[f32; 4]>,
    translations: Vec<[f32; 3]>,
}

impl Carrier {
    pub(super) fn translation(translations: Vec<[f32; 3]>) -> Self {
        Self { translations, joints: Vec::new(), inverse_binds: Vec::new() }
    }

    pub(super) fn skeleton(skeleton: &Skeleton) -> Self {
        let joints = skeleton.bones.iter().map(|bone| Joint {
            rotations: bone.rotations.iter().map(|turn| turn.as_quat().normalize().to_array()).collect(),
            translations: bone.positions.iter().map(|position| position.as_vec3().to_array()).collect(),
        });
        let inverse_binds = skeleton.bones.iter().map(|bone| {
            let [x, y, z] = (-bone.centre).as_vec3().to_array();
            [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, x, y, z, 1.0]
        });
        Self { translations: Vec::new(), joints: joints.collect(), inverse_binds: inverse_binds.collect() }
    }
}

/// A mesh as arrays for the file. Where texture coordinates differ around a vertex, at a seam, it is there several times.
pub(super) struct Arrays {
    faces: Vec<[u32; 3]>,
    base: Vec<[f32; 3]>,
    base_normals: Vec<[f32; 3]>,
    uv: Vec<[f32; 2]>,
    colours: Vec<[f32; 3]>,
    targets: Vec<Target>,
    weights: Vec<f32>,
    influences: Option<Influences>,
}

impl Arrays {
    pub(super) fn of(mesh: &AnimatedMesh<'_>, coded: &CodedMesh) -> Self {
        let (faces, sources, uv) = parted(mesh);
        let morph = &coded.morph;
        let pick = |rows: &[[f32; 3]]| sources.iter().map(|&vertex| rows[vertex as usize]).collect::<Vec<_>>();
        let targets = morph.targets.iter();
        Self {
            faces,
            base: pick(&morph.base),
            base_normals: pick(&morph.base_normals),
            uv,
            colours: mesh.vertex_colours.map_or_else(Vec::new, pick),
            targets: targets
                .map(|target| Target { positions: pick(&target.positions), normals: pick(&target.normals) })
                .collect(),
            weights: morph.weights.clone(),
            influences: coded.influences.as_ref().map(|influences| Influences {
                joints: sources.iter().map(|&vertex| influences.joints[vertex as usize]).collect(),
                weights: sources.iter().map(|&vertex| influences.weights[vertex as usize]).collect(),
            }),
        }
    }
}

/// The faces over parted vertices, the vertex that each comes from, and its texture coordinates, V downwards.
fn parted(mesh: &AnimatedMesh<'_>) -> (Vec<[u32; 3]>, Vec<u32>, Vec<[f32; 2]>) {
    let Some(uv) = mesh.uv else {
        return (mesh.faces.to_vec(), (0..mesh.vertex_count() as u32).collect(), Vec::new());
    };
    // A vertex takes its own place for the first coordinates that it has, so that those of no seam stay where they are.
    let mut sources: Vec<u32> = (0..mesh.vertex_count() as u32).collect();
    let mut places: Vec<Option<[f32; 2]>> = vec![None; sources.len()];
    let mut further: BTreeMap<(u32, [u32; 2]), u32> = BTreeMap::new();
    let mut faces = mesh.faces.to_vec();
    for (corner, [u, v]) in faces.as_flattened_mut().iter_mut().zip(uv.as_flattened()) {
        let (place, vertex) = ([*u, 1.0 - v], *corner);
        if places[vertex as usize].get_or_insert(place).map(f32::to_bits) != place.map(f32::to_bits) {
            *corner = *further.entry((vertex, place.map(f32::to_bits))).or_insert_with(|| {
                sources.push(vertex);
                places.push(Some(place));
                sources.len() as u32 - 1
            });
        }
    }
    (faces, sources, places.into_iter().map(Option::unwrap_or_default).collect())
}

/// A scene being built: one parent node that carries the common translation or the joints, the meshes, one animation.
pub(super) struct Document<'a> {
    root: Root,
    pieces: Vec<&'a [u8]>,
    length: usize,
    times: Option<Index<Accessor>>,
    parent: Index<Node>,
    skin: Option<Index<Skin>>,
    animation: Animation,
}

impl<'a> Document<'a> {
    pub(super) fn new(times: &'a [f32], carrier: &'a Carrier) -> Self {
        let mut root = Root::default();
        root.asset.generator = Some(format!("Modiste {}", env!("CARGO_PKG_VERSION")));
        let parent = root.push(Node { name: Some("figure".to_owned()), ..Node::default() });
        root.scene = Some(root.push(Scene {
            extensions: None,
            extras: None,
            name: Some("scene".to_owned()),
            nodes: vec![parent],
        }));
        let animation = Animation {
            extensions: None,
            extras: None,
            channels: Vec::new(),
            name: Some("animation".to_owned()),
            samplers: Vec::new(),
        };
        let mut document = Self { root, pieces: Vec::new(), length: 0, times: None, parent, skin: None, animation };
        if times.len() > 1 {
            document.times = Some(document.bounded(times.as_chunks::<1>().0, Type::Scalar, None));
        }
        if document.times.is_some() && !carrier.translations.is_empty() {
            let output = document.unbounded(&carrier.translations, Type::Vec3, None);
            document.animate(parent, Property::Translation, output);
        }
        if !carrier.joints.is_empty() {
            document.add_joints(carrier);
        }
        document
    }

    fn add_joints(&mut self, carrier: &'a Carrier) {
        let mut joints = Vec::new();
        for (number, joint) in (1..).zip(&carrier.joints) {
            let node = self.root.push(Node {
                name: Some(format!("joint {number}")),
                rotation: Some(UnitQuaternion(joint.rotations[0])),
                translation: Some(joint.translations[0]),
                ..Node::default()
            });
            let rotations = self.unbounded(&joint.rotations, Type::Vec4, None);
            self.animate(node, Property::Rotation, rotations);
            let translations = self.unbounded(&joint.translations, Type::Vec3, None);
            self.animate(node, Property::Translation, translations);
            joints.push(node);
        }
        self.root.nodes[self.parent.value()].children = Some(joints.clone());
        let inverse_bind_matrices = Some(self.unbounded(&carrier.inverse_binds, Type::Mat4, None));
        let name = Some("skeleton".to_owned());
        let skeleton = Some(self.parent);
        let skin = Skin { extensions: None, extras: None, inverse_bind_matrices, joints, name, skeleton };
        self.skin = Some(self.root.push(skin));
    }

    pub(super) fn add(&mut self, mesh: &AnimatedMesh<'_>, arrays: &'a Arrays) {
        let vertices = Some(BufferTarget::ArrayBuffer);
        let positions = self.bounded(&arrays.base, Type::Vec3, vertices);
        let normals = self.unbounded(&arrays.base_normals, Type::Vec3, vertices);
        let mut attributes =
            BTreeMap::from([(Valid(Semantic::Positions), positions), (Valid(Semantic::Normals), normals)]);
        if !arrays.uv.is_empty() {
            attributes.insert(Valid(Semantic::TexCoords(0)), self.unbounded(&arrays.uv, Type::Vec2, vertices));
        }
        if !arrays.colours.is_empty() {
            attributes.insert(Valid(Semantic::Colors(0)), self.unbounded(&arrays.colours, Type::Vec3, vertices));
        }
        if let Some(Influences { joints, weights }) = &arrays.influences {
            let bytes = bytemuck::cast_slice(joints);
            let joints = self.accessor(bytes, ComponentType::U8, Type::Vec4, joints.len(), vertices);
            attributes.insert(Valid(Semantic::Joints(0)), joints);
            attributes.insert(Valid(Semantic::Weights(0)), self.unbounded(weights, Type::Vec4, vertices));
        }
        let corners = arrays.faces.as_flattened();
        let triangles = Some(BufferTarget::ElementArrayBuffer);
        let indices =
            self.accessor(bytemuck::cast_slice(corners), ComponentType::U32, Type::Scalar, corners.len(), triangles);
        let targets: Vec<MorphTarget> = arrays
            .targets
            .iter()
            .map(|target| MorphTarget {
                positions: Some(self.bounded(&target.positions, Type::Vec3, vertices)),
                normals: Some(self.unbounded(&target.normals, Type::Vec3, vertices)),
                tangents: None,
            })
            .collect();
        let has_targets = !targets.is_empty();
        let primitive = Primitive {
            attributes,
            extensions: None,
            extras: None,
            indices: Some(indices),
            material: Some(self.root.push(material(mesh))),
            mode: Valid(Mode::Triangles),
            targets: has_targets.then_some(targets),
        };
        let shape = self.root.push(Mesh {
            extensions: None,
            extras: target_names(arrays.targets.len()),
            name: Some(mesh.name.to_owned()),
            primitives: vec![primitive],
            weights: has_targets.then(|| arrays.weights[..arrays.targets.len()].to_vec()),
        });
        let skin = arrays.influences.as_ref().and(self.skin);
        let node =
            self.root.push(Node { mesh: Some(shape), skin, name: Some(mesh.name.to_owned()), ..Node::default() });
        if (mesh.frames.frame_count() > 1 || self.times.is_none()) && skin.is_none() {
            self.root.nodes[self.parent.value()].children.get_or_insert_default().push(node);
        } else {
            // A mesh at rest does not travel with the others, and the joints alone place a skinned one.
            self.root.scenes[0].nodes.push(node);
        }
        if has_targets {
            let output = self.unbounded(arrays.weights.as_chunks::<1>().0, Type::Scalar, None);
            self.animate(node, Property::MorphTargetWeights, output);
        }
    }

    /// The header of the file up to where the pieces start, and the pieces.
    pub(super) fn finish(mut self) -> Result<(Vec<u8>, Vec<&'a [u8]>), gltf_json::Error> {
        if !self.animation.channels.is_empty() {
            self.root.animations.push(self.animation);
        }
        self.root.buffers.push(Buffer {
            byte_length: USize64::from(self.length),
            name: None,
            uri: None,
            extensions: None,
            extras: None,
        });
        let mut json = self.root.to_vec()?;
        json.resize(json.len().next_multiple_of(4), b' ');
        let total = 12 + 8 + json.len() + 8 + self.length;
        let mut header = Vec::with_capacity(28 + json.len());
        for word in [u32::from_le_bytes(*b"glTF"), 2, total as u32, json.len() as u32, u32::from_le_bytes(*b"JSON")] {
            header.extend(word.to_le_bytes());
        }
        header.extend(json);
        header.extend((self.length as u32).to_le_bytes());
        header.extend(b"BIN\0");
        Ok((header, self.pieces))
    }

    fn animate(&mut self, node: Index<Node>, path: Property, output: Index<Accessor>) {
        let Some(input) = self.times else { return };
        let sampler =
            Sampler { extensions: None, extras: None, input, interpolation: Valid(Interpolation::Linear), output };
        let sampler = Index::push(&mut self.animation.samplers, sampler);
        let target = gltf_json::animation::Target { extensions: None, extras: None, node, path: Valid(path) };
        self.animation.channels.push(Channel { sampler, target, extensions: None, extras: None });
    }

    /// Adds floats with the bounds that the specification asks of positions and times.
    fn bounded<const N: usize>(
        &mut self,
        rows: &'a [[f32; N]],
        kind: Type,
        target: Option<BufferTarget>,
    ) -> Index<Accessor> {
        let index = self.unbounded(rows, kind, target);
        let bound = |pick: fn(f32, f32) -> f32, start: f32| {
            let mut bound = [start; N];
            for row in rows {
                bound = std::array::from_fn(|axis| pick(bound[axis], row[axis]));
            }
            Some(serde_json::Value::from(bound.to_vec()))
        };
        let accessor = &mut self.root.accessors[index.value()];
        accessor.min = bound(f32::min, f32::INFINITY);
        accessor.max = bound(f32::max, f32::NEG_INFINITY);
        index
    }

    fn unbounded<const N: usize>(
        &mut self,
        rows: &'a [[f32; N]],
        kind: Type,
        target: Option<BufferTarget>,
    ) -> Index<Accessor> {
        self.accessor(bytemuck::cast_slice(rows.as_flattened()), ComponentType::F32, kind, rows.len(), target)
    }

    /// Adds a piece (its length is a multiple of 4) with a view and an accessor of its own.
    fn accessor(
        &mut self,
        piece: &'a [u8],
        component: ComponentType,
        kind: Type,
        count: usize,
        target: Option<BufferTarget>,
    ) -> Index<Accessor> {
        let view = self.root.push(View {
            buffer: Index::new(0),
            byte_length: USize64::from(piece.len()),
            byte_offset: Some(USize64::from(self.length)),
            byte_stride: None,
            name: None,
            target: target.map(Valid),
            extensions: None,
            extras: None,
        });
        self.length += piece.len();
        self.pieces.push(piece);
        self.root.push(Accessor {
            buffer_view: Some(view),
            byte_offset: None,
            count: USize64::from(count),
            component_type: Valid(GenericComponentType(component)),
            extensions: None,
            extras: None,
            type_: Valid(kind),
            min: None,
            max: None,
            name: None,
            normalized: false,
            sparse: None,
        })
    }
}

fn material(mesh: &AnimatedMesh<'_>) -> Material {
    Material {
        name: Some(mesh.name.to_owned()),
        double_sided: mesh.double_sided,
        alpha_mode: Valid(if mesh.colour[3] < 1.0 {
            gltf_json::material::AlphaMode::Blend
        } else {
            gltf_json::material::AlphaMode::Opaque
        }),
        pbr_metallic_roughness: PbrMetallicRoughness {
            base_color_factor: PbrBaseColorFactor(mesh.colour),
            metallic_factor: StrengthFactor(0.0),
            roughness_factor: StrengthFactor(mesh.roughness),
            ..PbrMetallicRoughness::default()
        },
        ..Material::default()
    }
}

/// The names that editors show for the targets, by the convention of `extras.targetNames`.
fn target_names(count: usize) -> gltf_json::Extras {
    if count == 0 {
        return None;
    }
    let names: Vec<String> = (1..=count).map(|k| format!("component {k}")).collect();
    serde_json::value::to_raw_value(&serde_json::json!({ "targetNames": names })).ok()
}
