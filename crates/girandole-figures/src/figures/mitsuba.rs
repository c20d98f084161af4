//! Pictures by Mitsuba 3 (Jakob et al. 2022), where the system's Python has it.

use anyhow::{Context, Result, ensure};
use girandole_core::glam::Vec3;
use girandole_core::image::Image;
use girandole_core::scene::{Geometry, MaterialId, Scene, View};
use girandole_reference::image_file::read_exr;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

const SCRIPT: &str = include_str!("mitsuba.py");
/// Tried in turn: the first is quicker, and needs an LLVM that it can use.
const VARIANTS: [&str; 2] = ["llvm_ad_rgb", "scalar_rgb"];

/// What Mitsuba made.
pub struct Rendered {
    /// Its version and variant.
    pub name: String,
    /// Samples a pixel, seconds, and the picture.
    pub pictures: Vec<(u32, f64, Image)>,
}

/// Mitsuba's version; nothing where Python has none.
pub fn version() -> Option<String> {
    let print = "import mitsuba; print(mitsuba.__version__)";
    let output = Command::new("python3").args(["-c", print]).output().ok()?;
    let version = String::from_utf8_lossy(&output.stdout).trim().to_owned();
    (output.status.success() && !version.is_empty()).then_some(version)
}

/// Pictures of a scene with Lambertian surfaces and emitters, by paths of at most so many segments: one for each
/// number of samples a pixel.
///
/// # Errors
/// Where the scene has what is not translated, a file cannot be written, or Mitsuba fails.
pub fn render(
    version: &str,
    scene: &Scene,
    (view, size): (&View, [u32; 2]),
    segments: u32,
    counts: &[u32],
) -> Result<Rendered> {
    let folder = tempfile::tempdir()?;
    write_scene(folder.path(), scene, (view, size), segments)?;
    let (variant, pictures) = run(folder.path(), counts)?;
    Ok(Rendered { name: format!("Mitsuba {version}, {variant}"), pictures })
}

type Pictures = Vec<(u32, f64, Image)>;

fn run(folder: &Path, counts: &[u32]) -> Result<(&'static str, Pictures)> {
    let script = folder.join("render.py");
    std::fs::write(&script, SCRIPT)?;
    let mut failures = Vec::new();
    for variant in VARIANTS {
        let mut command = Command::new("python3");
        command.arg(&script).arg(variant).arg(folder).args(counts.iter().map(u32::to_string));
        let output = command.output()?;
        if output.status.success() {
            return Ok((variant, pictures(folder, &String::from_utf8_lossy(&output.stdout))?));
        }
        let words = String::from_utf8_lossy(&output.stderr);
        failures.push(format!("{variant}: {}", words.lines().last().unwrap_or_default()));
    }
    anyhow::bail!("Mitsuba fails: {}", failures.join("; "))
}

/// Reads what the script wrote and printed.
fn pictures(folder: &Path, lines: &str) -> Result<Pictures> {
    let picture = |line: &str| {
        let (count, seconds) = line.split_once(' ').context("Mitsuba's script printed something else")?;
        let file: PathBuf = folder.join(format!("{count}.exr"));
        Ok((count.parse()?, seconds.parse()?, read_exr(&file)?))
    };
    // A bar of progress may stand before it.
    lines.lines().filter_map(|line| line.split_once("rendered ").map(|(_, rest)| rest)).map(picture).collect()
}

fn write_scene(folder: &Path, scene: &Scene, (view, size): (&View, [u32; 2]), segments: u32) -> Result<()> {
    ensure!(
        scene.lights.is_empty() && scene.environment.is_none() && scene.textures.is_empty(),
        "punctual lights, environments and textures are not translated for Mitsuba"
    );
    let geometry = Geometry::new(scene);
    let mut xml = String::from("<scene version=\"3.0.0\">\n");
    let _ = writeln!(
        xml,
        "<integrator type=\"path\"><integer name=\"max_depth\" value=\"{segments}\"/></integrator>"
    );
    sensor(&mut xml, &geometry, view, size);
    for (index, material) in scene.materials.iter().enumerate() {
        ensure!(
            material.specular == 0.0 && material.metallic == 0.0 && !material.is_transparent(),
            "surfaces that are not Lambertian are not translated for Mitsuba"
        );
        let file = folder.join(format!("{index}.ply"));
        if !write_triangles(&file, &geometry, index.into())? {
            continue;
        }
        let color = rgb("reflectance", material.base_color);
        let mut surface = format!("<bsdf type=\"diffuse\">{color}</bsdf>");
        if material.double_sided {
            surface = format!("<bsdf type=\"twosided\">{surface}</bsdf>");
        }
        if material.emits() {
            let _ =
                write!(surface, "<emitter type=\"area\">{}</emitter>", rgb("radiance", material.emission));
        }
        let file = format!("<string name=\"filename\" value=\"{index}.ply\"/>");
        let _ = writeln!(xml, "<shape type=\"ply\">{file}{surface}</shape>");
    }
    xml.push_str("</scene>\n");
    std::fs::write(folder.join("scene.xml"), xml)?;
    Ok(())
}

fn rgb(name: &str, color: Vec3) -> String {
    format!("<rgb name=\"{name}\" value=\"{} {} {}\"/>", color.x, color.y, color.z)
}

fn sensor(xml: &mut String, geometry: &Geometry, view: &View, size: [u32; 2]) {
    let local = view.relative_to(geometry.origin);
    let triple = |v: Vec3| format!("{}, {}, {}", v.x, v.y, v.z);
    let [eye, target, up] = [local.eye, local.eye + local.forward, local.up].map(triple);
    let degrees = 2.0 * local.half_extent.y.atan().to_degrees();
    let _ = writeln!(
        xml,
        "<sensor type=\"perspective\"><string name=\"fov_axis\" value=\"y\"/><float name=\"fov\" value=\"{degrees}\"/>\
         <float name=\"near_clip\" value=\"0.01\"/>\
         <transform name=\"to_world\"><lookat origin=\"{eye}\" target=\"{target}\" up=\"{up}\"/></transform>\
         <film type=\"hdrfilm\"><integer name=\"width\" value=\"{}\"/><integer name=\"height\" value=\"{}\"/>\
         <rfilter type=\"box\"/></film><sampler type=\"independent\"/></sensor>",
        size[0], size[1]
    );
}

/// Writes the triangles of a material; whether there are any.
fn write_triangles(file: &Path, geometry: &Geometry, material: MaterialId) -> Result<bool> {
    let triangles: Vec<_> = geometry.triangles.iter().filter(|t| t.material == material).collect();
    let mut ply = format!("ply\nformat ascii 1.0\nelement vertex {}\n", 3 * triangles.len());
    for property in ["x", "y", "z", "nx", "ny", "nz"] {
        let _ = writeln!(ply, "property float {property}");
    }
    let _ =
        writeln!(ply, "element face {}\nproperty list uchar int vertex_indices\nend_header", triangles.len());
    for vertex in triangles.iter().flat_map(|triangle| triangle.vertices) {
        let [p, n] = [geometry.positions[vertex as usize], geometry.normals[vertex as usize]];
        let _ = writeln!(ply, "{} {} {} {} {} {}", p.x, p.y, p.z, n.x, n.y, n.z);
    }
    for first in (0..triangles.len()).map(|triangle| 3 * triangle) {
        let _ = writeln!(ply, "3 {first} {} {}", first + 1, first + 2);
    }
    std::fs::write(file, ply)?;
    Ok(!triangles.is_empty())
}
