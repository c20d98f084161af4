//! The browser's compiler takes what naga takes.

use super::called;
use super::driver::EVENTS;
use crate::browser::View;
use crate::test::{Bench, Check};
use anyhow::{Result, ensure};
use serde_json::{Value, json};
use std::time::Duration;

/// All of them.
pub const CHECKS: &[Check] = &[Check { name: "shaders/all-are-taken-by-the-browser", needs: &[], run: all }];

const PATIENCE: Duration = Duration::from_secs(120);
/// Sent at a time.
const FEW: usize = 8;

fn all(bench: &Bench) -> Result<()> {
    let shaders = called(bench, &["info", "--shaders"])?;
    let shaders: Vec<Value> = serde_json::from_slice(&shaders)?;
    ensure!(shaders.len() > 100, "there are {} shaders", shaders.len());
    let tab = bench.open(EVENTS, &View::default())?;
    let compile = |shaders: &[Value]| {
        tab.evaluate_within(
            &format!(
                "(async () => {{
                   globalThis.device ??= await (await navigator.gpu.requestAdapter()).requestDevice();
                   const said = [];
                   for (const [name, code] of {}) {{
                     const info = await device.createShaderModule({{ code }}).getCompilationInfo();
                     for (const {{ lineNum, message }} of info.messages) said.push(`${{name}}, line ${{lineNum}}: ${{message}}`);
                   }}
                   return said;
                 }})()",
                json!(shaders)
            ),
            PATIENCE,
        )
    };
    for shaders in shaders.chunks(FEW) {
        let said = compile(shaders)?;
        ensure!(said == json!([]), "the compiler says: {said}");
    }
    // The control, with what the browser says of it on the console.
    let wrong = json!(["wrong", "@compute @workgroup_size(1) fn main() { let x: u32 = 1.5; }"]);
    let said = compile(&[wrong])?;
    ensure!(said.as_array().is_some_and(|said| said.len() == 1), "the compiler says nothing to an error");
    tab.wait_for_trouble(Duration::from_secs(5))?;
    Ok(())
}
