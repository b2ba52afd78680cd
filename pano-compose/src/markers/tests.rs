//! Markers drawn into pictures, found again.

use super::*;
use glam::{DQuat, Mat3};

/// A printed marker of side `size` at `world_from_marker`, with a white rim of one module.
pub(crate) struct Print {
    pattern: Pattern,
    size: f32,
    marker_from_world: Affine3A,
}

impl Print {
    pub(crate) fn new(id: u32, size: f32, world_from_marker: Affine3A) -> Self {
        Self { pattern: Pattern::new("tag36h11", id).unwrap(), size, marker_from_world: world_from_marker.inverse() }
    }

    /// What a ray from the origin sees of it.
    fn look(&self, d: Vec3) -> Option<f32> {
        let (o, d) = (Vec3::from(self.marker_from_world.translation), self.marker_from_world.transform_vector3(d));
        let t = -o.y / d.y;
        let at = o + d * t;
        let modules = self.pattern.side() as f32;
        // Modules from the print's top left corner of the black square.
        let (x, y) = ((at.x / self.size + 0.5) * modules, (at.z / self.size + 0.5) * modules);
        let rim = -1.0..modules + 1.0;
        if t <= 0.0 || !rim.contains(&x) || !rim.contains(&y) {
            return None;
        }
        let module = [x, y].map(|v| f64::from(v.floor()));
        let white = self.pattern.white(module, module.map(|v| v + 1.0));
        Some(if white > 0.5 { 0.9 } else { 0.05 })
    }
}

/// A picture of prints before a gray, uneven background, box-filtered.
pub(crate) fn photograph(camera: &Camera, prints: &[Print]) -> RadianceImage {
    const GRID: usize = 4;
    RadianceImage::par_from_fn(camera.width, camera.height, |x, y| {
        let mut sum = 0.0;
        for i in 0..GRID * GRID {
            let offset = (Vec2::new((i % GRID) as f32, (i / GRID) as f32) + 0.5) / GRID as f32;
            let d = camera.direction(Vec2::new(x as f32, y as f32) + offset);
            let background = 0.35 + 0.1 * (5.0 * d.x).sin() * (4.0 * d.y).cos() * (3.0 * d.z).sin();
            sum += prints.iter().find_map(|p| p.look(d)).unwrap_or(background);
        }
        Vec3::splat(sum / (GRID * GRID) as f32)
    })
}

/// A marker `distance` away in the direction (longitude, latitude), its normal tilted by `tilt` off the line of sight, all in
/// degrees, and turned in its plane.
fn place(longitude: f32, latitude: f32, distance: f32, tilt: f32, turn: f32) -> Affine3A {
    let to = rotation_from_yaw_pitch(longitude, latitude) * Vec3::NEG_Z;
    let across = to.any_orthonormal_vector();
    let normal = Quat::from_axis_angle(across, tilt.to_radians()) * -to;
    let right = Quat::from_axis_angle(normal, turn.to_radians()) * normal.any_orthonormal_vector();
    let rotation = Quat::from_mat3(&Mat3::from_cols(right, normal, right.cross(normal)));
    Affine3A::from_rotation_translation(rotation, to * distance)
}

pub(crate) fn panorama(width: usize) -> Camera {
    Camera { position: Vec3::ZERO, world_from_camera: Quat::IDENTITY, projection: Projection::Panorama, width, height: width / 2 }
}

fn marker(id: u32, size: f32) -> Marker {
    Marker { family: "tag36h11", id, size }
}

/// (relative error of the position, error of the orientation in degrees).
fn errors(found: &Found, truth: &Affine3A) -> (f32, f32) {
    let off = (found.world_from_marker.translation - truth.translation).length() / truth.translation.length();
    let turn = |place: &Affine3A| DQuat::from_mat3(&glam::Mat3::from(place.matrix3).as_dmat3());
    (off, turn(&found.world_from_marker).angle_between(turn(truth)).to_degrees() as f32)
}

/// Forty pixels and more, any longitude, the seam included, up to 60° latitude: within 1 % of the distance and 1°.
#[test]
fn markers_in_a_panorama_are_found_where_they_are() {
    let camera = panorama(2048);
    // 0.2 m at this distance is this many pixels of 2048/360 a degree, seen straight on.
    let distance = |pixels: f32| 0.1 / (0.5 * (pixels * 360.0 / 2048.0).to_radians()).tan();
    let cases = [
        (0.0, 0.0, 40.0, 45.0, 10.0),
        (180.0, 5.0, 44.0, 40.0, 100.0),
        (-178.0, -30.0, 60.0, 50.0, 200.0),
        (75.0, 60.0, 50.0, 35.0, 300.0),
        (-100.0, -60.0, 50.0, 45.0, 33.0),
        (33.0, -45.0, 80.0, 55.0, 150.0),
        (120.0, 20.0, 120.0, 30.0, 270.0),
    ];
    let places: Vec<Affine3A> =
        cases.iter().map(|&(lon, lat, px, tilt, turn)| place(lon, lat, distance(px), tilt, turn)).collect();
    let prints: Vec<Print> = places.iter().enumerate().map(|(i, p)| Print::new(i as u32 * 7 + 1, 0.2, *p)).collect();
    let picture = photograph(&camera, &prints);
    let markers: Vec<Marker> = (0..cases.len()).map(|i| marker(i as u32 * 7 + 1, 0.2)).collect();
    let found = find(&picture, &camera, &markers).unwrap();
    for (i, (case, truth)) in cases.iter().zip(&places).enumerate() {
        let found = found.iter().find(|f| f.id == markers[i].id).unwrap_or_else(|| panic!("{case:?} is not found"));
        let (off, turn) = errors(found, truth);
        println!("{case:?}: {:.2} % and {turn:.2}° off, residual {:.3}°", 100.0 * off, found.error_degrees);
        assert!(off < 0.01 && turn < 1.0, "{case:?}: {off} {turn}");
        assert!(!found.ambiguous && found.error_degrees < 0.05, "{found:?}");
    }
}

/// The same from straight on and nearly so, where two poses all but fit and the tilt shows by hundredths of a pixel; at all
/// longitudes with the seam, and up to 60° latitude.
#[test]
fn frontal_markers_are_found_where_they_are() {
    let camera = panorama(2048);
    let distance = |pixels: f32| 0.1 / (0.5 * (pixels * 360.0 / 2048.0).to_radians()).tan();
    let places: Vec<(f32, f32, f32, Affine3A)> = (0..12)
        .map(|i| {
            let (latitude, tilt) = ([-60.0, 0.0, 45.0, -30.0, 60.0][i % 5], [0.0, 2.0, 8.0, 45.0][i % 4]);
            let (longitude, pixels) = (-180.0 + 30.0 * i as f32, [40.0, 47.0, 60.0][i % 3]);
            (longitude, latitude, tilt, place(longitude, latitude, distance(pixels), tilt, 37.0 * i as f32))
        })
        .collect();
    let prints: Vec<Print> = places.iter().enumerate().map(|(i, p)| Print::new(i as u32 * 5 + 2, 0.2, p.3)).collect();
    let markers: Vec<Marker> = (0..places.len()).map(|i| marker(i as u32 * 5 + 2, 0.2)).collect();
    let found = find(&photograph(&camera, &prints), &camera, &markers).unwrap();
    for (i, (longitude, latitude, tilt, truth)) in places.iter().enumerate() {
        let case = format!("{longitude}°, {latitude}°, tilted {tilt}°");
        let found = found.iter().find(|f| f.id == markers[i].id).unwrap_or_else(|| panic!("{case} is not found"));
        let (off, turn) = errors(found, truth);
        println!("{case}: {:.3} % and {turn:.3}° off, ambiguous {}", 100.0 * off, found.ambiguous);
        assert!(off < 0.01 && turn < 1.0, "{case}: {off} {turn}");
    }
}

#[test]
fn a_marker_in_a_perspective_picture_stands_in_the_world() {
    let camera = Camera {
        position: Vec3::new(1.0, 1.5, 2.0),
        world_from_camera: rotation_from_yaw_pitch(25.0, -30.0),
        projection: Projection::Pinhole { focal: Vec2::new(500.0, 510.0), center: Vec2::new(322.0, 236.0) },
        width: 640,
        height: 480,
    };
    // On the table: +Y of the marker is up.
    let ahead = camera.direction(Vec2::new(280.0, 300.0));
    let truth = Affine3A::from_rotation_translation(Quat::from_rotation_y(0.4), ahead * 1.3);
    let found = find(&photograph(&camera, &[Print::new(5, 0.15, truth)]), &camera, &[marker(5, 0.15)]).unwrap();
    let at_origin = Affine3A {
        translation: found[0].world_from_marker.translation - glam::Vec3A::from(camera.position),
        ..found[0].world_from_marker
    };
    let (off, turn) = errors(&Found { world_from_marker: at_origin, ..found[0] }, &truth);
    assert!(off < 0.01 && turn < 1.0, "{off} {turn}");
    assert!((found[0].distance - 1.3).abs() < 0.013);
    let up = found[0].world_from_marker.transform_vector3(Vec3::Y);
    assert!(up.dot(Vec3::Y) > 0.9998, "{up}");
}

#[test]
fn what_is_not_there_is_not_found() {
    let camera = panorama(512);
    let empty = photograph(&camera, &[]);
    assert_eq!(find(&empty, &camera, &[marker(1, 0.1)]).unwrap(), []);
    // Another number, or another family.
    let picture = photograph(&panorama(1024), &[Print::new(4, 0.2, place(10.0, 0.0, 0.6, 40.0, 0.0))]);
    assert_eq!(find(&picture, &panorama(1024), &[marker(5, 0.2)]).unwrap(), []);
    let other = Marker { family: "tag25h9", ..marker(4, 0.2) };
    assert_eq!(find(&picture, &panorama(1024), &[other]).unwrap(), []);
    for odd in [RadianceImage::filled(2, 1, Vec3::ONE), RadianceImage::filled(1, 1, Vec3::ZERO)] {
        let (width, height) = odd.size();
        let camera = Camera { width, height, ..panorama(2) };
        assert_eq!(find(&odd, &camera, &[marker(1, 0.1)]).unwrap(), []);
    }
    let unknown = Marker { family: "qr", id: 1, size: 0.1 };
    assert!(find(&empty, &camera, &[unknown]).unwrap_err().to_string().contains("qr"));
    assert!(find(&empty, &panorama(64), &[marker(1, 0.1)]).is_err());
}

#[test]
fn exact_bearings_give_the_exact_pose() {
    for (tilt, distance) in [(0.0, 1.0), (20.0, 0.5), (50.0, 2.0), (75.0, 5.0)] {
        for longitude in [0.0, 90.0, 180.0, 300.0] {
            let truth = place(longitude, 35.0, distance, tilt, 77.0);
            let s = 0.05;
            let corners = [Vec3::new(s, 0.0, -s), Vec3::new(s, 0.0, s), Vec3::new(-s, 0.0, s), Vec3::new(-s, 0.0, -s)];
            let bearings = corners.map(|c| truth.transform_point3(c).as_dvec3().normalize());
            let (pose, _) = pose_from_bearings(bearings, 0.1).unwrap();
            let off = pose.position.distance(Vec3::from(truth.translation).as_dvec3()) / f64::from(distance);
            assert!(off < 1e-3 && pose.error < 1e-5, "{tilt} {distance} {longitude}: {off} {}", pose.error);
        }
    }
    let same = [DVec3::Z; 4];
    assert!(pose_from_bearings(same, 0.1).is_none());
    let behind = [DVec3::X, DVec3::Z, DVec3::NEG_X, DVec3::NEG_Z];
    assert!(pose_from_bearings(behind, 0.1).is_none_or(|(pose, _)| pose.error.is_finite()));
}
