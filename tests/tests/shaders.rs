//! Every shader is valid in every specialisation, and structures lie in memory as Rust lays them: checks that need no GPU.

use naga::valid::{Capabilities, ValidationFlags, Validator};
use naga::{Module, ShaderStage, back::PipelineConstants};
use pano_core::gpu::{Layout, Shader};
use pano_tests::shaders;

fn parse(shader: &Shader) -> Module {
    let source = shader.source();
    naga::front::wgsl::parse_str(&source).unwrap_or_else(|e| panic!("{}: {}", shader.name, e.emit_to_string(&source)))
}

/// What wgpu's default limits promise on every GPU.
const MOST_STORAGE_BUFFERS: usize = 8;
const MOST_INVOCATIONS: u32 = 256;

#[test]
fn every_specialization_is_valid() {
    let mut names = std::collections::BTreeSet::new();
    for shader in shaders::all() {
        assert!(names.insert(shader.name), "two shaders are called {}", shader.name);
        assert!(!shader.specializations.is_empty(), "{} is never compiled", shader.name);
        let module = parse(shader);
        for special in shader.specializations {
            let what = format!("{}:{} {:?}", shader.name, special.entry, special.constants);
            let entry = module.entry_points.iter().find(|e| e.name == special.entry).unwrap_or_else(|| panic!("{what}"));
            assert_eq!(entry.stage, ShaderStage::Compute, "{what}");
            let [x, y, z] = entry.workgroup_size;
            assert!(x * y * z <= MOST_INVOCATIONS, "{what}: {} invocations", x * y * z);
            for (name, _) in special.constants {
                assert!(
                    module.overrides.iter().any(|(_, o)| o.name.as_deref() == Some(name)),
                    "{what}: there is no override `{name}`"
                );
            }
            // No capability beyond plain WGSL is allowed.
            let mut validator = Validator::new(ValidationFlags::all(), Capabilities::empty());
            let info = validator.validate(&module).unwrap_or_else(|e| panic!("{what}: {}", e.emit_to_string(&shader.source())));
            let constants: PipelineConstants = special.constants.iter().map(|&(n, v)| (n.to_owned(), v)).collect();
            let stage = Some((ShaderStage::Compute, special.entry));
            let (special_module, special_info) =
                naga::back::pipeline_constants::process_overrides(&module, &info, stage, &constants)
                    .unwrap_or_else(|e| panic!("{what}: {e}"));
            let index = special_module.entry_points.iter().position(|e| e.name == special.entry).unwrap();
            let used = special_info.get_entry_point(index);
            let storage = special_module.global_variables.iter().filter(|(handle, variable)| {
                matches!(variable.space, naga::AddressSpace::Storage { .. }) && !used[*handle].is_empty()
            });
            assert!(storage.count() <= MOST_STORAGE_BUFFERS, "{what}: too many storage buffers");
        }
        let compiled = |name: &str| shader.specializations.iter().any(|s| s.entry == name);
        for entry in &module.entry_points {
            assert!(compiled(&entry.name), "{}: no specialisation of {}", shader.name, entry.name);
        }
    }
}

/// Where naga puts the fields of a structure.
fn fields(shader: &Shader, name: &str) -> Option<(usize, Vec<(String, usize)>)> {
    let module = parse(shader);
    let (_, found) = module.types.iter().find(|(_, t)| t.name.as_deref() == Some(name))?;
    let naga::TypeInner::Struct { members, span } = &found.inner else { return None };
    Some((*span as usize, members.iter().map(|m| (m.name.clone().unwrap_or_default(), m.offset as usize)).collect()))
}

#[test]
fn structures_lie_as_shaders_read_them() {
    let layouts: Vec<(&Shader, Layout)> = shaders::layouts();
    assert!(!layouts.is_empty());
    for (shader, layout) in layouts {
        let (bytes, found) = fields(shader, layout.name).unwrap_or_else(|| panic!("{}: no struct {}", shader.name, layout.name));
        let wanted: Vec<(String, usize)> = layout.fields.iter().map(|&(n, at)| (n.to_owned(), at)).collect();
        assert_eq!(found, wanted, "{}: {}", shader.name, layout.name);
        assert_eq!(bytes, layout.bytes, "{}: {}", shader.name, layout.name);
    }
}

/// The harness itself: a shader that is wrong is found.
#[test]
fn a_wrong_shader_does_not_pass() {
    let parses = |text: &str| naga::front::wgsl::parse_str(text).is_ok();
    assert!(parses("@compute @workgroup_size(1) fn main() {}"));
    assert!(!parses("@compute @workgroup_size(1) fn main() { let x: u32 = 1.5; }"));
}
