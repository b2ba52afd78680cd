//! From the two levels of the CPU to one array of nodes, one of triangles and one of instances.

use super::super::{Blas, Tlas};
use super::{DEPTH, Instance, NOTHING, Node, OPAQUE_KIND, Triangle};
use bytemuck::Zeroable;
use glam::{Mat4, Vec3, Vec3A};
use obvhs::{BvhBuildParams, aabb::Aabb, bvh2::builder::build_bvh2, bvh2::node::Bvh2Node};
use std::collections::HashMap;
use std::sync::Arc;
use std::time::Duration;

/// The arrays.
#[derive(Debug, Default)]
pub(super) struct Flat {
    pub(super) nodes: Vec<Node>,
    pub(super) triangles: Vec<Triangle>,
    pub(super) instances: Vec<Instance>,
    /// Of the upper trees; [`NOTHING`] for one without instances.
    pub(super) roots: Vec<u32>,
}

/// All of some hierarchies. A mesh that is placed more than once is there once.
pub(super) fn flatten(hierarchies: &[&Tlas]) -> Flat {
    let (mut flat, mut meshes) = (Flat::default(), HashMap::new());
    for tlas in hierarchies {
        let root = flat.add_hierarchy(tlas, &mut meshes);
        flat.roots.push(root);
    }
    flat
}

impl Flat {
    /// Adds the instances of a hierarchy, and those meshes that are not there yet (`roots` has them by their address); its root.
    fn add_hierarchy(&mut self, tlas: &Tlas, roots: &mut HashMap<*const Blas, u32>) -> u32 {
        let mut instances = Vec::new();
        for (index, instance) in tlas.instances.iter().enumerate() {
            let root = *roots.entry(Arc::as_ptr(&instance.blas)).or_insert_with(|| self.add_mesh(&instance.blas));
            let rows = Mat4::from(instance.mesh_from_world).transpose();
            let [x, y, z] = [rows.x_axis, rows.y_axis, rows.z_axis].map(|row| row.to_array());
            instances.push(Instance { x, y, z, root, index: index as u32, kind: OPAQUE_KIND, pad2: 0 });
        }
        if instances.is_empty() {
            return NOTHING;
        }
        let boxes: Vec<Aabb> = tlas.instances.iter().map(|i| i.bounds).collect();
        let tree = Tree::build(&boxes, BvhBuildParams::fast_build());
        let begin = self.instances.len() as u32;
        self.instances.extend(tree.order.iter().map(|&i| instances[i as usize]));
        self.add_nodes(tree, begin)
    }

    /// Adds a mesh; its root.
    fn add_mesh(&mut self, blas: &Blas) -> u32 {
        // No corner may lie outside its box by the rounding of its edges.
        let bounds = |t: &obvhs::rt_triangle::RtTriangle| {
            let corners = [t.v0, t.v0 - t.e1, t.v0 + t.e2];
            let box_of = Aabb::from_points(&corners);
            let pad = corners.iter().fold(Vec3A::ZERO, |most, c| most.max(c.abs())) * 2.0 * f32::EPSILON;
            Aabb::new(box_of.min - pad, box_of.max + pad)
        };
        let boxes: Vec<Aabb> = blas.triangles.iter().map(bounds).collect();
        if boxes.is_empty() {
            return self.add_empty();
        }
        let tree = Tree::build(&boxes, BvhBuildParams::medium_build());
        let begin = self.triangles.len() as u32;
        self.triangles.extend(tree.order.iter().map(|&i| {
            let t = &blas.triangles[i as usize];
            let [v0, e1, e2, ng] = [t.v0, t.e1, t.e2, t.ng].map(Vec3::from);
            Triangle { v0, face: blas.bvh.primitive_indices[i as usize], e1, pad1: 0, e2, pad2: 0, ng, pad3: 0 }
        }));
        self.add_nodes(tree, begin)
    }

    /// A mesh without triangles: a box that no ray meets, twice.
    fn add_empty(&mut self) -> u32 {
        let root = self.nodes.len() as u32;
        let nowhere = Node { lo: Vec3::MAX, first: root + 1, hi: Vec3::MIN, count: 0 };
        self.nodes.extend([nowhere; 3]);
        root
    }

    /// Adds a tree whose leaves begin at `begin`; its root.
    fn add_nodes(&mut self, tree: Tree, begin: u32) -> u32 {
        let base = self.nodes.len() as u32;
        self.nodes.extend(tree.nodes.into_iter().map(|n| Node { first: n.first + if n.count > 0 { begin } else { base }, ..n }));
        base
    }
}

/// A tree over boxes.
struct Tree {
    nodes: Vec<Node>,
    /// The boxes in the order of the leaves.
    order: Vec<u32>,
}

impl Tree {
    /// `obvhs`' tree, or one of the least depth where that is too deep: a hundred faces in one place make ninety levels.
    fn build(boxes: &[Aabb], params: BvhBuildParams) -> Self {
        let bvh = build_bvh2(boxes, params, &mut Duration::default());
        let node =
            |n: &Bvh2Node| Node { lo: n.aabb.min.into(), first: n.first_index, hi: n.aabb.max.into(), count: n.prim_count };
        let tree = Self { nodes: bvh.nodes.iter().map(node).collect(), order: bvh.primitive_indices };
        if tree.depth() <= DEPTH { tree } else { Self::balanced(boxes) }
    }

    /// Levels of nodes.
    fn depth(&self) -> usize {
        let (mut open, mut deepest) = (vec![(0u32, 1usize)], 0);
        while let Some((node, depth)) = open.pop() {
            deepest = deepest.max(depth);
            let node = &self.nodes[node as usize];
            if node.count == 0 {
                open.extend([0, 1].map(|child| (node.first + child, depth + 1)));
            }
        }
        deepest
    }

    /// Halves by number along the longest axis: 32 levels at most.
    fn balanced(boxes: &[Aabb]) -> Self {
        /// Boxes of a leaf.
        const LEAF: usize = 4;
        let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
        let mut nodes = vec![Node::zeroed()];
        let mut open = vec![(0usize, 0..boxes.len())];
        while let Some((node, range)) = open.pop() {
            let part = &mut order[range.clone()];
            let (lo, hi) = part
                .iter()
                .map(|&i| &boxes[i as usize])
                .fold((Vec3A::INFINITY, Vec3A::NEG_INFINITY), |(lo, hi), b| (lo.min(b.min), hi.max(b.max)));
            let (lo, hi) = (Vec3::from(lo), Vec3::from(hi));
            if part.len() <= LEAF {
                nodes[node] = Node { lo, first: range.start as u32, hi, count: part.len() as u32 };
                continue;
            }
            let axis = (hi - lo).max_position();
            let middle = part.len() / 2;
            // The order of equal centres does not depend on anything but their indices.
            let centre = |i: &u32| boxes[*i as usize].min[axis] + boxes[*i as usize].max[axis];
            part.sort_by(|a, b| centre(a).total_cmp(&centre(b)).then(a.cmp(b)));
            let first = nodes.len();
            nodes[node] = Node { lo, first: first as u32, hi, count: 0 };
            nodes.extend([Node::zeroed(); 2]);
            let cut = range.start + middle;
            open.extend([(first, range.start..cut), (first + 1, cut..range.end)]);
        }
        Self { nodes, order }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Affine3A;

    /// Faces in one place make a chain of the usual builder.
    #[test]
    fn trees_are_never_too_deep() {
        for count in [1, 4, 5, 1000] {
            let boxes = vec![Aabb::new(Vec3A::ZERO, Vec3A::ONE); count];
            let tree = Tree::build(&boxes, BvhBuildParams::medium_build());
            assert!(tree.depth() <= DEPTH, "{count} boxes: {} levels", tree.depth());
            let mut order = tree.order.clone();
            order.sort();
            assert_eq!(order, (0..count as u32).collect::<Vec<_>>());
        }
        assert_eq!(Tree::balanced(&vec![Aabb::new(Vec3A::ZERO, Vec3A::ONE); 1024]).depth(), 9);
    }

    #[test]
    fn every_face_is_there_once_and_in_its_boxes() {
        let positions: Vec<Vec3> = (0..60).map(|i| Vec3::new(i as f32, (i * i % 17) as f32, (i * 3 % 11) as f32)).collect();
        let faces: Vec<[u32; 3]> = (0..20).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let mesh = Arc::new(Blas::build(&positions, &faces));
        let place = |i: i32| (mesh.clone(), Affine3A::from_translation(Vec3::X * 100.0 * i as f32));
        let places: Vec<_> = (0..7).map(place).collect();
        let flat = flatten(&[&Tlas::build(places), &Tlas::build([(mesh, Affine3A::IDENTITY)])]);
        assert_eq!((flat.triangles.len(), flat.instances.len()), (20, 8), "one mesh in eight places, of two hierarchies");
        assert_eq!(flat.instances[0].root, flat.instances[7].root);
        assert_eq!(flat.nodes[flat.roots[1] as usize].first, 7);
        let mut seen = [0; 20];
        let mut open = vec![flat.instances[0].root];
        while let Some(node) = open.pop() {
            let node = flat.nodes[node as usize];
            for t in &flat.triangles[node.first as usize..][..node.count as usize] {
                seen[t.face as usize] += 1;
                for corner in faces[t.face as usize].map(|v| positions[v as usize]) {
                    assert!(corner.cmpge(node.lo).all() && corner.cmple(node.hi).all(), "{corner} {node:?}");
                }
            }
            if node.count == 0 {
                open.extend([node.first, node.first + 1]);
            }
        }
        assert_eq!(seen, [1; 20]);
        assert_eq!(flatten(&[&Tlas::build([])]).roots, [NOTHING]);
    }
}
