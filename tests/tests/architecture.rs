//! The house rules that a machine can check: folders and their documentation, dependency arrows, commands in the README.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the crate lies in the workspace").to_owned()
}

fn read(path: &str) -> String {
    std::fs::read_to_string(root().join(path)).unwrap_or_else(|e| panic!("{path}: {e}"))
}

/// The manifest in `folder` of the workspace.
fn manifest(folder: &str) -> toml::Table {
    let path = if folder.is_empty() { "Cargo.toml".to_owned() } else { format!("{folder}/Cargo.toml") };
    read(&path).parse().unwrap_or_else(|e| panic!("{path}: {e}"))
}

/// Folders of the workspace's members.
fn members() -> Vec<String> {
    let members = manifest("")["workspace"]["members"].as_array().expect("a list of members").clone();
    members.iter().map(|m| m.as_str().expect("a member is a string").to_owned()).collect()
}

/// Package name → (folder, names of the dependencies of any kind).
fn packages() -> BTreeMap<String, (String, BTreeSet<String>)> {
    let package = |folder: String| {
        let manifest = manifest(&folder);
        let name = manifest["package"]["name"].as_str().expect("a package has a name").to_owned();
        let kinds = ["dependencies", "dev-dependencies", "build-dependencies"];
        let tables = kinds.iter().filter_map(|kind| manifest.get(*kind)?.as_table());
        (name, (folder, tables.flat_map(|t| t.keys().cloned()).collect()))
    };
    members().into_iter().map(package).collect()
}

/// Adds `folder` (relative to the root) and the folders below it that hold files.
fn collect_folders(folder: &str, found: &mut BTreeSet<String>) {
    for entry in std::fs::read_dir(root().join(folder)).unwrap_or_else(|e| panic!("{folder}: {e}")) {
        let entry = entry.unwrap();
        let is_folder = entry.file_type().unwrap().is_dir();
        if is_folder {
            collect_folders(&format!("{folder}{}/", entry.file_name().to_str().unwrap()), found);
        } else {
            found.insert(folder.to_owned());
        }
    }
}

/// The paths that start the lines of the list of folders.
fn documented_folders() -> Vec<String> {
    let text = read("docs/ARCHITECTURE.md");
    let lines = text.lines().filter_map(|line| line.strip_prefix("- `")?.split_once("/` — "));
    lines
        .map(|(path, what)| (format!("{path}/"), what))
        .map(|(path, what)| {
            assert!(what.ends_with('.'), "{path} is described in a sentence");
            path
        })
        .collect()
}

#[test]
fn every_documented_folder_exists_once() {
    let documented = documented_folders();
    assert!(documented.len() > 10, "the list of folders was not found: {documented:?}");
    let mut seen = BTreeSet::new();
    for folder in documented {
        assert!(root().join(&folder).is_dir(), "docs/ARCHITECTURE.md names {folder}, which does not exist");
        assert!(seen.insert(folder.clone()), "docs/ARCHITECTURE.md names {folder} twice");
    }
}

#[test]
fn every_source_folder_is_documented() {
    let mut folders = BTreeSet::new();
    for member in members() {
        for part in ["src", "tests", "benches", "examples"] {
            if root().join(&member).join(part).is_dir() {
                collect_folders(&format!("{member}/{part}/"), &mut folders);
            }
        }
    }
    // Data of tests is described by the test beside it.
    folders.retain(|f| !f.starts_with("tests/tests/"));
    folders.extend(["docs/", ".ci/", "tests/tests/"].map(String::from));
    let documented: BTreeSet<String> = documented_folders().into_iter().collect();
    let missing: Vec<&String> = folders.difference(&documented).collect();
    assert!(missing.is_empty(), "add a line for each of {missing:?} to the list of folders in docs/ARCHITECTURE.md");
}

#[test]
fn dependencies_point_down_only() {
    let allowed = BTreeMap::from([
        ("pano-core", vec![]),
        ("pano-trace", vec!["pano-core"]),
        ("pano-denoise", vec!["pano-core"]),
        ("pano-light", vec!["pano-core"]),
        ("pano-compose", vec!["pano-core", "pano-trace", "pano-denoise", "pano-light"]),
        ("pano-cli", vec!["pano-core", "pano-trace", "pano-denoise", "pano-light", "pano-compose"]),
    ]);
    let packages = packages();
    for (name, (_, dependencies)) in &packages {
        let ours = dependencies.iter().filter(|d| packages.contains_key(*d));
        if name == "pano-tests" {
            continue;
        }
        let allowed =
            allowed.get(name.as_str()).unwrap_or_else(|| panic!("give {name} a place among the arrows, here and in the docs"));
        for dependency in ours {
            assert!(allowed.contains(&dependency.as_str()), "{name} may not depend on {dependency}");
        }
    }
    for name in allowed.keys() {
        assert!(packages.contains_key(*name), "{name} is gone");
    }
}

#[test]
fn versions_and_lints_live_in_the_root_manifest() {
    for member in members() {
        let manifest = manifest(&member);
        assert_eq!(manifest["lints"]["workspace"].as_bool(), Some(true), "{member}: lints");
        for key in ["version", "edition", "rust-version", "license"] {
            assert_eq!(manifest["package"][key]["workspace"].as_bool(), Some(true), "{member}: package.{key}");
        }
        for kind in ["dependencies", "dev-dependencies", "build-dependencies"] {
            for (name, dependency) in manifest.get(kind).and_then(|t| t.as_table()).into_iter().flatten() {
                let inherited = dependency.get("workspace").and_then(|w| w.as_bool());
                assert_eq!(inherited, Some(true), "{member}: {kind}.{name} must say `workspace = true`");
            }
        }
    }
}

#[test]
fn the_readme_names_existing_packages_and_files() {
    let readme = read("README.md");
    let packages = packages();
    let commands: Vec<&str> =
        readme.lines().filter(|l| ["cargo run ", "cargo test "].iter().any(|start| l.starts_with(start))).collect();
    assert_eq!(commands.len(), 2, "two commands for a newcomer: {commands:?}");
    let mut named = 0;
    for text in readme.split('`').chain(commands) {
        let words: Vec<&str> = text.split_whitespace().collect();
        for pair in words.windows(2).filter(|pair| words[0] == "cargo" && pair[0] == "-p") {
            assert!(packages.contains_key(pair[1]), "README.md: `{text}` names the package {}", pair[1]);
            named += 1;
        }
    }
    assert!(named >= 2, "no command with a package was found in README.md");
    // Links; pictures are made by the program and may be missing.
    for link in readme.split("](").skip(1).filter_map(|rest| rest.split_once(')')).map(|(link, _)| link) {
        if !link.contains("://") && !link.starts_with("docs/images/") {
            assert!(root().join(link).exists(), "README.md links to {link}");
        }
    }
}
