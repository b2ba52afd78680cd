//! The built-in room as things to trace, and as a scene file.

use super::DemoParams;
use crate::pipeline::Result;
use glam::{Affine3A, Quat, Vec3};
use pano_core::{
    builtin::room::{Room, RoomObject},
    camera::{Camera, Projection, rotation_from_yaw_pitch},
    mesh::Mesh,
};
use pano_trace::bvh::Ray;
use pano_trace::objects::{Objects, Placement, PreparedMesh};
use std::fmt::Write;
use std::sync::Arc;

/// File names, relative to the scene file.
pub(super) const COLOR_FILE: &str = "pano_color.exr";
pub(super) const DEPTH_FILE: &str = "pano_depth.exr";
pub(super) const SCENE_FILE: &str = "scene.toml";

/// The room and what is put into it, with their BVHs.
#[derive(Clone, Debug)]
pub(super) struct Place {
    /// The room; its mesh has moved to `mesh`.
    room: Room,
    mesh: Arc<PreparedMesh>,
    /// The objects' meshes, in the room's order.
    pub(super) objects: Vec<Arc<PreparedMesh>>,
}

impl Place {
    /// Models the room.
    pub(super) fn new() -> Result<Self> {
        let mut room = Room::new();
        let mesh = Arc::new(PreparedMesh::new(std::mem::take(&mut room.mesh))?);
        let prepare = |o: &RoomObject| Ok(Arc::new(PreparedMesh::new(o.mesh.clone())?));
        let objects = room.objects.iter().map(prepare).collect::<Result<_>>()?;
        Ok(Self { room, mesh, objects })
    }

    /// The same room with other objects in it, seen in another view: degrees to the right, up, and of its height.
    pub(super) fn furnished(&self, objects: Vec<RoomObject>, [yaw, pitch, vfov]: [f32; 3]) -> Result<Self> {
        let mut room = self.room.clone();
        (room.view_yaw, room.view_pitch, room.view_vfov) = (yaw, pitch, vfov);
        room.objects = objects;
        let prepare = |o: &RoomObject| Ok(Arc::new(PreparedMesh::new(o.mesh.clone())?));
        let objects = room.objects.iter().map(prepare).collect::<Result<_>>()?;
        Ok(Self { room, mesh: self.mesh.clone(), objects })
    }

    /// The same room with a varnished table, `roughness` telling how smooth.
    pub(super) fn varnished(&self, roughness: f32) -> Result<Self> {
        let mut mesh = self.mesh.mesh().clone();
        // From below the lamp that hangs over its middle.
        let above = Ray::new(Vec3::Y, Vec3::NEG_Y);
        if let Some(hit) = self.mesh.blas().intersect(&above) {
            let top = &mut mesh.materials[self.mesh.mesh().material_id(hit.triangle as usize) as usize];
            (top.specular, top.roughness) = (1.0, roughness);
        }
        Ok(Self { mesh: Arc::new(PreparedMesh::new(mesh)?), ..self.clone() })
    }

    /// The same room with that lying in it.
    #[cfg(feature = "markers")]
    pub(super) fn with_print(&self, print: &Mesh) -> Result<Self> {
        let mut mesh = self.mesh.mesh().clone();
        mesh.append(print);
        Ok(Self { mesh: Arc::new(PreparedMesh::new(mesh)?), ..self.clone() })
    }

    /// What is put into the room.
    pub(super) fn contents(&self) -> &[RoomObject] {
        &self.room.objects
    }

    /// The empty room.
    pub(super) fn without_objects(&self) -> Objects {
        Objects::new(&[self.room_placement()])
    }

    /// The room with the objects really in it.
    pub(super) fn with_objects(&self) -> Objects {
        let mut placements = vec![self.room_placement()];
        placements.extend(self.room.objects.iter().zip(&self.objects).map(|(object, mesh)| Placement {
            mesh: mesh.clone(),
            world_from_mesh: Affine3A::from_rotation_translation(Quat::from_rotation_y(object.yaw.to_radians()), object.position),
            material: Some(object.material.clone()),
        }));
        Objects::new(&placements)
    }

    fn room_placement(&self) -> Placement {
        Placement { mesh: self.mesh.clone(), world_from_mesh: Affine3A::IDENTITY, material: None }
    }

    /// Whether a face of the room is an opening to the sky.
    pub(super) fn is_window(&self, triangle: u32) -> bool {
        self.room.window_materials.contains(&self.mesh.mesh().material_id(triangle as usize))
    }

    /// The 360° camera at the capture point, looking to −Z.
    pub(super) fn panorama(&self, width: usize) -> Camera {
        Camera {
            position: self.room.capture_position,
            world_from_camera: Quat::IDENTITY,
            projection: Projection::Panorama,
            width,
            height: width / 2,
        }
    }

    /// The view onto the table.
    pub(super) fn view(&self, (width, height): (usize, usize)) -> Camera {
        Camera {
            position: self.room.capture_position,
            world_from_camera: rotation_from_yaw_pitch(self.room.view_yaw, self.room.view_pitch),
            projection: Projection::Perspective { vfov: self.room.view_vfov.to_radians() },
            width,
            height,
        }
    }

    /// Corners of the objects' bounding boxes, in the world.
    pub(super) fn object_corners(&self) -> impl Iterator<Item = glam::Vec3> + '_ {
        self.room.objects.iter().flat_map(|object| {
            let (low, high) = object.mesh.bounds().unwrap_or_default();
            let turn = Quat::from_rotation_y(object.yaw.to_radians());
            (0..8).map(move |i| {
                let pick = |bit: u32, low: f32, high: f32| if i >> bit & 1 == 0 { low } else { high };
                let corner = glam::Vec3::new(pick(0, low.x, high.x), pick(1, low.y, high.y), pick(2, low.z, high.z));
                object.position + turn * corner
            })
        })
    }

    /// The objects' meshes with the names of their files.
    pub(super) fn mesh_files(&self) -> impl Iterator<Item = (String, &Mesh)> {
        self.room.objects.iter().map(|o| (mesh_file(o), &o.mesh))
    }

    /// The scene file: the captured room, the objects and the view. Numbers are written so that reading them gives the same
    /// bits.
    pub(super) fn scene_file(&self, params: &DemoParams) -> String {
        let list = |values: &[f32]| format!("[{}]", values.iter().map(|v| format!("{v:?}")).collect::<Vec<_>>().join(", "));
        let room = &self.room;
        let mut text = String::from("# Written by `pano demo`. Render it with: pano render scene.toml -o out.exr\n\n");
        // Writing to a string does not fail.
        let mut put = |line: std::fmt::Arguments<'_>| writeln!(text, "{line}").unwrap_or_default();
        put(format_args!("[panorama]\ncolor = \"{COLOR_FILE}\"\ndepth = \"{DEPTH_FILE}\"\ndepth_format = \"exr\""));
        put(format_args!("position = {}", list(&room.capture_position.to_array())));
        for object in &room.objects {
            let m = &object.material;
            put(format_args!("\n[[object]] # {}\nmesh = \"{}\"", object.name, mesh_file(object)));
            put(format_args!("position = {}\nyaw = {:?}", list(&object.position.to_array()), object.yaw));
            put(format_args!(
                "material = {{ base_color = {}, metallic = {:?}, roughness = {:?}, specular = {:?}, ior = {:?}, transmission = {:?} }}",
                list(&m.base_color.to_array()),
                m.metallic,
                m.roughness,
                m.specular,
                m.ior,
                m.transmission
            ));
        }
        put(format_args!("\n[view]\nkind = \"perspective\"\nyaw = {:?}\npitch = {:?}", room.view_yaw, room.view_pitch));
        put(format_args!("vfov = {:?}\nsize = [{}, {}]", room.view_vfov, params.view.0, params.view.1));
        put(format_args!("\n[render]\nmethod = \"auto\"\nsamples = {}\nbounces = {}", params.samples, params.bounces));
        text
    }
}

fn mesh_file(object: &RoomObject) -> String {
    format!("{}.ply", object.name.replace(' ', "-"))
}
