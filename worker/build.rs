//! Gives the solver's build a name: the version, and a hash over the sources of the core and the versions of its
//! dependencies. Two executables with one name compute the same bits on one instruction set.

use std::fs;
use std::path::{Path, PathBuf};

fn main() {
    let root = Path::new("..");
    let mut files = vec![root.join("Cargo.lock"), root.join("core/Cargo.toml")];
    collect(&root.join("core/src"), &mut files);
    files.sort();
    // FNV-1a: this names a build, it protects nothing.
    let mut hash: u64 = 0xcbf2_9ce4_8422_2325;
    for file in &files {
        let name = file.display().to_string();
        let text = fs::read(file).unwrap_or_default();
        for byte in name.bytes().chain(text) {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
        println!("cargo::rerun-if-changed={name}");
    }
    println!("cargo::rerun-if-changed=../core/src");
    let version = env!("CARGO_PKG_VERSION");
    println!("cargo::rustc-env=SALP_BUILD={version}-{hash:016x}");
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            collect(&path, files);
        } else {
            files.push(path);
        }
    }
}
