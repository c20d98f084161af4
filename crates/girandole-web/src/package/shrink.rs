//! Makes WebAssembly smaller by Binaryen's `wasm-opt`.

use crate::toolchain::path_folders;
use anyhow::{Context, Result, bail};
use std::path::Path;
use std::process::Command;
use wasmparser::{ExternalKind, Parser, Payload, RefType, TypeRef};

/// What Rust's compiler uses of WebAssembly on this target, and wasm-bindgen with it.
const FEATURES: [&str; 6] = [
    "--enable-bulk-memory",
    "--enable-multivalue",
    "--enable-mutable-globals",
    "--enable-nontrapping-float-to-int",
    "--enable-reference-types",
    "--enable-sign-ext",
];

/// What makes it smaller, in this order: once more in another shape.
const PASSES: [&str; 5] = ["-Os", "--flatten", "--rereloop", "-Oz", "-Oz"];

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
        .args(PASSES)
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
    let mut bytes = std::fs::read(file).with_context(|| format!("cannot read {}", file.display()))?;
    if mend_export(&mut bytes).with_context(|| format!("{} is broken", file.display()))? {
        std::fs::write(file, bytes).with_context(|| format!("cannot write {}", file.display()))?;
    }
    Ok(())
}

/// Whether the export was wrong. Nothing else of the file changes.
fn mend_export(bytes: &mut [u8]) -> Result<bool> {
    let (mut tables, mut export) = (Vec::new(), None);
    for payload in Parser::new(0).parse_all(bytes) {
        match payload? {
            Payload::ImportSection(imports) => {
                for import in imports.into_imports() {
                    if let TypeRef::Table(table) = import?.ty {
                        tables.push(table.element_type);
                    }
                }
            }
            Payload::TableSection(section) => {
                for table in section {
                    tables.push(table?.ty.element_type);
                }
            }
            Payload::ExportSection(exports) => {
                for item in exports.into_iter_with_offsets() {
                    let (at, item) = item?;
                    if item.kind == ExternalKind::Table && item.name == EXTERNREFS {
                        // Behind the name, its length and the kind, which take a byte each.
                        export = Some((at + item.name.len() + 2, item.index));
                    }
                }
            }
            _ => {}
        }
    }
    let right = tables.iter().position(|table| *table == RefType::EXTERNREF);
    let (Some(right), Some((at, index))) = (right, export) else { return Ok(false) };
    if right == index as usize {
        return Ok(false);
    }
    let byte = |index: usize| u8::try_from(index).ok().filter(|index| *index < 128);
    let (Some(right), Some(wrong)) = (byte(right), byte(index as usize)) else {
        bail!("it has more than 127 tables");
    };
    match bytes.get_mut(at) {
        Some(place) if *place == wrong => *place = right,
        _ => bail!("its exports are not where they should be"),
    }
    Ok(true)
}

#[cfg(test)]
mod tests {
    use super::*;
    use walrus::{ExportItem, Module, RefType};

    #[test]
    fn an_export_of_the_wrong_table_is_mended() {
        let mut module = Module::default();
        let functions = module.tables.add_local(false, 1, None, RefType::FUNCREF);
        let values = module.tables.add_local(false, 1, None, RefType::EXTERNREF);
        module.exports.add("functions", functions);
        let wrong = module.exports.add(EXTERNREFS, functions);
        let mut bytes = module.emit_wasm();
        assert!(mend_export(&mut bytes).expect("a module"));
        let mended = Module::from_buffer(&bytes).expect("a module");
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
        assert!(!mend_export(&mut bytes).expect("a module"), "it is right now");
        module.exports.delete(wrong);
        module.exports.add(EXTERNREFS, values);
        assert!(!mend_export(&mut module.emit_wasm()).expect("a module"), "it was right");
        assert!(mend_export(&mut bytes[..40].to_vec()).is_err(), "it is cut off");
    }
}
