//! Makes WebAssembly smaller by Binaryen's `wasm-opt`.

use crate::toolchain::path_folders;
use anyhow::{Context, Result, bail};
use std::path::Path;
use std::process::Command;
use walrus::{ExportItem, Module, ModuleConfig, RefType};

/// What Rust's compiler uses of WebAssembly on this target, and wasm-bindgen with it.
const FEATURES: [&str; 6] = [
    "--enable-bulk-memory",
    "--enable-multivalue",
    "--enable-mutable-globals",
    "--enable-nontrapping-float-to-int",
    "--enable-reference-types",
    "--enable-sign-ext",
];

/// The table of JavaScript's values, by the name that wasm-bindgen's code knows it by.
const EXTERNREFS: &str = "__wbindgen_externrefs";

/// Makes a file smaller, if `wasm-opt` is installed.
pub fn shrink(file: &Path) -> Result<()> {
    let name = format!("wasm-opt{}", std::env::consts::EXE_SUFFIX);
    let programs = path_folders().into_iter().map(|folder| folder.join(&name));
    let Some(program) = programs.into_iter().find(|file| file.is_file()) else {
        eprintln!("wasm-opt is not installed (Debian package binaryen): files are larger without it");
        return Ok(());
    };
    let smaller = file.with_extension("smaller");
    let status = Command::new(&program)
        // The second time finds more.
        .args(["-Os", "-Os"])
        .args(FEATURES)
        .arg(file)
        .arg("-o")
        .arg(&smaller)
        .status()
        .with_context(|| format!("{} does not start", program.display()))?;
    if !status.success() {
        bail!("{} fails; install a newer Binaryen, or remove it from PATH", program.display());
    }
    mend(&smaller)?;
    std::fs::rename(&smaller, file).with_context(|| format!("cannot replace {}", file.display()))
}

/// Binaryen before version 110 exports the first table whichever was meant (its issue 4711), and no page starts: the
/// export is set right where it is wrong.
fn mend(file: &Path) -> Result<()> {
    let mut config = ModuleConfig::new();
    config.generate_name_section(false).generate_producers_section(false);
    let read = Module::from_file_with_config(file, &config);
    let mut module = read.with_context(|| format!("{} is broken", file.display()))?;
    if !mend_export(&mut module) {
        return Ok(());
    }
    module.emit_wasm_file(file).with_context(|| format!("cannot write {}", file.display()))
}

/// Whether the export was wrong.
fn mend_export(module: &mut Module) -> bool {
    let right =
        module.tables.iter().find(|table| table.element_ty == RefType::EXTERNREF).map(|table| table.id());
    let export = module.exports.iter_mut().find(|export| export.name == EXTERNREFS);
    let (Some(right), Some(export)) = (right, export) else { return false };
    if matches!(export.item, ExportItem::Table(table) if table == right) {
        return false;
    }
    export.item = right.into();
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_export_of_the_wrong_table_is_mended() {
        let mut module = Module::default();
        let functions = module.tables.add_local(false, 1, None, RefType::FUNCREF);
        let values = module.tables.add_local(false, 1, None, RefType::EXTERNREF);
        module.exports.add("functions", functions);
        module.exports.add(EXTERNREFS, functions);
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("a.wasm");
        module.emit_wasm_file(&file).expect("a file");
        mend(&file).expect("mended");
        let mut mended = Module::from_file(&file).expect("a module");
        let types: Vec<_> = mended
            .exports
            .iter()
            .map(|export| match export.item {
                ExportItem::Table(table) => (export.name.clone(), mended.tables.get(table).element_ty),
                _ => panic!("{} is no table", export.name),
            })
            .collect();
        assert!(types.contains(&("functions".into(), RefType::FUNCREF)), "{types:?}");
        assert!(types.contains(&(EXTERNREFS.into(), RefType::EXTERNREF)), "{types:?}");
        assert!(!mend_export(&mut mended), "it is right now");
        module.exports.remove(EXTERNREFS).expect("an export");
        module.exports.add(EXTERNREFS, values);
        assert!(!mend_export(&mut module), "it was right");
    }
}
