//! Every method over the scenes in which things go wrong.

use pano_compose::pipeline::{Backend, write_output};
use pano_core::io;
use pano_core::scene::Method;
use pano_tests::nasty::{METHODS, beyond_half_precision, scenes};

/// Checks every scene by one method, and names all that fail.
fn all(method: Method) {
    let failures: Vec<String> = scenes()
        .iter()
        .filter(|scene| scene.suits(method))
        .filter_map(|scene| {
            let checked = std::panic::catch_unwind(|| scene.check(method, &scene.render(method, Backend::Cpu)));
            checked.err().map(|e| match e.downcast::<String>() {
                Ok(message) => *message,
                Err(_) => format!("{}: panic", scene.name),
            })
        })
        .collect();
    assert!(failures.is_empty(), "{method:?}:\n{}", failures.join("\n"));
}

#[test]
fn iprt_survives_nasty_scenes() {
    all(Method::Iprt);
}

#[test]
fn dpt_survives_nasty_scenes() {
    all(Method::Dpt);
}

#[test]
fn mr360_survives_nasty_scenes() {
    all(Method::Mr360);
}

#[test]
fn rt2ar_survives_nasty_scenes() {
    all(Method::Rt2ar);
}

#[test]
fn ibl_survives_nasty_scenes() {
    all(Method::Ibl);
}

#[test]
fn onepass_survives_nasty_scenes() {
    all(Method::Onepass);
}

#[test]
fn twopass_survives_nasty_scenes() {
    all(Method::Twopass);
}

#[test]
fn every_method_is_tried() {
    assert_eq!(METHODS.len(), 7);
    assert!(METHODS.iter().all(|method| scenes().iter().any(|scene| scene.suits(*method))));
}

/// Half floats end at 65504: a sun written as one would come back infinite.
#[test]
fn suns_beyond_half_precision_come_back() {
    let scene = beyond_half_precision();
    let rendered = scene.render(Method::Dpt, Backend::Cpu);
    let folder = tempfile::tempdir().unwrap();
    write_output(&folder.path().join("out.exr"), &rendered).unwrap();
    let back = io::read_image(folder.path().join("out.exr")).unwrap();
    assert!(back.report.is_clean(), "{:?}", back.report);
    assert_eq!(back.radiance.get(5, 4), scene.picture.get(5, 4));
    assert_eq!(back.radiance.data(), rendered.composite.color.data());
}
