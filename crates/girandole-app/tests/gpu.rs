//! The program on a graphics adapter. Without one, these tests are reported as ignored.

#[path = "shared/pixels.rs"]
mod pixels;

use libtest_mimic::{Arguments, Failed, Trial};
use pixels::differ;
use std::path::Path;
use std::process::{Command, Output};

type Check = fn(&Path) -> Result<(), Failed>;

fn main() {
    let has_adapter = girandole(Path::new("."), "info --require-adapter").status.success();
    let checks: [(&str, Check); 15] = [
        ("same_command_same_bytes", same_command_same_bytes),
        ("the_command_in_the_statistics_makes_the_same_picture", same_picture_by_its_command),
        ("refined_pictures_repeat_and_are_better", refined_pictures),
        ("parts_join_to_the_bytes_of_the_whole", parts_join),
        ("parts_of_no_picture_are_refused", no_parts),
        ("pictures_larger_than_the_devices_are_drawn_in_windows", windows),
        ("agrees_with_traced_shadows", agrees_with_traced_shadows),
        ("statistics_name_passes_and_counts", statistics_name_passes_and_counts),
        ("little_memory_gives_a_picture_and_a_sentence", little_memory_gives_a_picture_and_a_sentence),
        ("maps_that_do_not_fit_are_refused", maps_that_do_not_fit_are_refused),
        ("bench_times_modes", bench_times_modes),
        ("bench_times_motion", bench_times_motion),
        ("frames_are_the_same_alone_and_in_sequence", frames_are_the_same_alone_and_in_sequence),
        ("transfer_is_kept_and_changes_the_picture", transfer_is_kept),
        ("frames_of_a_budget_are_the_same_alone_and_resumed", frames_of_a_budget),
    ];
    let trials = checks
        .into_iter()
        .map(|(name, check)| {
            let run = move || check(tempfile::tempdir()?.path());
            Trial::test(name, run).with_ignored_flag(!has_adapter)
        })
        .collect();
    libtest_mimic::run(&Arguments::from_args(), trials).exit();
}

fn girandole(directory: &Path, arguments: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_girandole"))
        .args(arguments.split_whitespace())
        .current_dir(directory)
        .env("GIRANDOLE_CACHE", directory.join("cache"))
        .output()
        .unwrap_or_else(|e| panic!("the program does not start: {e}"))
}

fn succeed(directory: &Path, arguments: &str) -> Result<Output, Failed> {
    let output = girandole(directory, arguments);
    let said = String::from_utf8_lossy(&output.stderr);
    if output.status.success() { Ok(output) } else { Err(format!("{arguments}: {said}").into()) }
}

fn ensure(condition: bool, otherwise: &str) -> Result<(), Failed> {
    if condition { Ok(()) } else { Err(otherwise.into()) }
}

const SMALL: &str = "render table --size 96x72 --lights 48 --engine gpu";

fn transfer_is_kept(directory: &Path) -> Result<(), Failed> {
    let render = |more: &str| -> Result<(Vec<u8>, String), Failed> {
        let said =
            succeed(directory, &format!("{SMALL} --object torus --transfer-rays 512 {more} -o p.exr"))?;
        let said = String::from_utf8_lossy(&said.stderr).into_owned();
        Ok((std::fs::read(directory.join("p.exr"))?, said))
    };
    let (without, _) = render("")?;
    let (grid, _) = render("--transfer grid --stats s.json")?;
    ensure(differ(&without, &grid), "transfer changes nothing")?;
    let stats: serde_json::Value = serde_json::from_slice(&std::fs::read(directory.join("s.json"))?)?;
    for key in ["transfer_objects", "transfer_points", "incident_light_us_per_light"] {
        ensure(stats[key].as_f64().is_some_and(|value| value > 0.0), key)?;
    }
    ensure(differ(&render("--transfer centre")?.0, &grid), "the grid changes nothing")?;
    let kept = directory.join("cache/transfer");
    let files: Vec<_> = std::fs::read_dir(&kept)?.collect::<Result<_, _>>()?;
    ensure(files.len() == 1, "where light is gathered makes no other transfer")?;
    std::fs::write(files[0].path(), b"GIRTRANS and nothing else")?;
    let (again, said) = render("--transfer grid")?;
    ensure(again == grid && said.contains("simulated the light transfer of"), &said)?;
    let (read, said) = render("--transfer grid")?;
    ensure(read == grid && !said.contains("simulated"), &said)
}

fn same_command_same_bytes(directory: &Path) -> Result<(), Failed> {
    let render = |more: &str| -> Result<Vec<u8>, Failed> {
        succeed(directory, &format!("{SMALL} {more} -o p.exr"))?;
        Ok(std::fs::read(directory.join("p.exr"))?)
    };
    let first = render("--aa 2")?;
    ensure(first == render("--aa 2")?, "the same command leaves other bytes")?;
    ensure(first == render("")?, "full is not anti-aliased by default")?;
    ensure(render("--mode naive")? == render("--mode naive --aa off")?, "naive is anti-aliased by default")?;
    ensure(differ(&first, &render("--aa off")?), "anti-aliasing changes nothing")?;
    ensure(differ(&first, &render("--aa 2 --seed 1")?), "another seed changes nothing")
}

fn same_picture_by_its_command(directory: &Path) -> Result<(), Failed> {
    let edits = r#"{"version": 1, "edits": [{"set_time": {"seconds": 0.7}},
        {"insert_object": {"name": "pot", "shape": "teapot", "transform": {"parts": {"translation": [0.1, 0.9, 0]}}}},
        {"set_emission": {"material": {"index": 5, "name": "wood"}, "emission": [0.1, 0.2, 3]}}]}"#;
    std::fs::write(directory.join("e.json"), edits)?;
    let options = "--view 1,1.6,1.5,0,0.8,-1e-7,0,1,0.1,61.3 --edits e.json --exposure -0.3 --stats s.json";
    succeed(directory, &format!("{SMALL} {options} -o p.png"))?;
    let first = std::fs::read(directory.join("p.png"))?;
    let stats: serde_json::Value = serde_json::from_slice(&std::fs::read(directory.join("s.json"))?)?;
    let command = stats["command"].as_str().ok_or("no command")?.replace('\'', "");
    std::fs::remove_file(directory.join("p.png"))?;
    succeed(directory, command.strip_prefix("girandole ").ok_or("another program")?)?;
    ensure(first == std::fs::read(directory.join("p.png"))?, "the command makes another picture")?;
    succeed(directory, &command.replace("girandole ", "").replace("61.3", "61.4"))?;
    ensure(differ(&first, &std::fs::read(directory.join("p.png"))?), "another view changes nothing")?;
    let small = "--size 32x24 --lights 8 --repeat 1 --map-size 32";
    succeed(directory, &format!("bench table {small} --view 1,1.6,1.5,0,0.8,0,0,1,0,60 --edits e.json"))?;
    Ok(())
}

fn refined_pictures(directory: &Path) -> Result<(), Failed> {
    let render = |sets: u32, name: &str, more: &str| -> Result<Vec<u8>, Failed> {
        succeed(directory, &format!("{SMALL} --refine {sets} {more} -o {name}.exr --stats {name}.json"))?;
        Ok(std::fs::read(directory.join(format!("{name}.exr")))?)
    };
    let stats = |name: &str| -> Result<serde_json::Value, Failed> {
        Ok(serde_json::from_slice(&std::fs::read(directory.join(format!("{name}.json")))?)?)
    };
    // One set is the picture without the option.
    let one = render(1, "one", "")?;
    succeed(directory, &format!("{SMALL} -o plain.exr"))?;
    ensure(one == std::fs::read(directory.join("plain.exr"))?, "one set is another picture")?;
    let few = render(3, "few", "")?;
    ensure(few == render(3, "again", "")? && differ(&few, &one), "the same command leaves other bytes")?;
    let command = stats("few")?["command"].to_string();
    ensure(command.contains("--refine 3") && stats("few")?["light_sets"] == 3, &command)?;
    // The estimate falls, as the error does.
    render(12, "many", "")?;
    let error = |name: &str| -> Result<f64, Failed> {
        stats(name)?["estimated_rel_mse"].as_f64().ok_or_else(|| "no estimate".into())
    };
    ensure(error("many")? < 0.6 * error("few")?, "the estimated error does not fall")?;
    ensure(stats("one")?.get("estimated_rel_mse").is_none(), "one set says something of its error")?;
    let path = SMALL.replace("--engine gpu", "--engine path --paths 128");
    succeed(directory, &format!("{path} -o path.exr"))?;
    succeed(directory, "compare path.exr many.exr --max-rel-mse 0.006 --max-energy-error 0.03")?;
    let far = girandole(directory, "compare path.exr one.exr --max-rel-mse 0.006");
    ensure(far.status.code() == Some(1), "a picture of one set passes for a refined one")
}

fn parts_join(directory: &Path) -> Result<(), Failed> {
    let read = |name: &str| std::fs::read(directory.join(name));
    let render = |more: &str| succeed(directory, &format!("{SMALL} {more}"));
    let regions = ["0,0,50,40", "50,0,46,40", "0,40,96,32"];
    // Pixels, with alpha.
    let transparent = "--background transparent --view 0,1.7,6,0,0.8,0,0,1,0,60";
    render(&format!("{transparent} -o whole.exr"))?;
    for (index, region) in regions.iter().enumerate() {
        render(&format!("{transparent} --region {region} -o r{index}.exr"))?;
    }
    succeed(directory, "join r2.exr r0.exr r1.exr -o joined.exr")?;
    ensure(read("joined.exr")? == read("whole.exr")?, "joined pixels are others")?;
    render(&format!("{transparent} -o whole.png"))?;
    succeed(directory, "join r0.exr r1.exr r2.exr -o joined.png")?;
    ensure(read("joined.png")? == read("whole.png")?, "joined pixels are shown otherwise")?;
    // Light sets, and both.
    render("--refine 5 -o whole.exr")?;
    render("--refine 5 --sets 0..1 -o a.exr")?;
    render("--refine 5 --sets 2..4 -o b.exr")?;
    succeed(directory, "join b.exr a.exr -o joined.exr")?;
    ensure(read("joined.exr")? == read("whole.exr")?, "joined light sets are others")?;
    ensure(differ(&read("a.exr")?, &read("whole.exr")?), "some light sets are all of them")?;
    for (index, region) in regions.iter().enumerate() {
        for (name, sets) in [("a", "0..2"), ("b", "3..4")] {
            render(&format!("--refine 5 --sets {sets} --region {region} -o {name}{index}.exr"))?;
        }
    }
    succeed(directory, "join a0.exr a1.exr a2.exr b0.exr b1.exr b2.exr -o joined.exr")?;
    ensure(read("joined.exr")? == read("whole.exr")?, "joined pixels of light sets are others")?;
    // A piece that is there is not made again.
    let made = directory.join("b2.exr").metadata()?.modified()?;
    let said = render(&format!("--refine 5 --sets 3..4 --region {} -o b2.exr", regions[2]))?;
    ensure(String::from_utf8_lossy(&said.stderr).contains("b2.exr was there"), "it is made again")?;
    ensure(made == directory.join("b2.exr").metadata()?.modified()?, "it is written again")?;
    // Light is sampled once for all pieces of a view, and there were two.
    let kept = std::fs::read_dir(directory.join("cache/lights"))?.count();
    ensure(kept == 2, &format!("light is sampled {kept} times"))
}

fn windows(directory: &Path) -> Result<(), Failed> {
    // The windows meet at column 4500.
    let large = "render pillars --size 9000x24 --lights 12 --engine gpu --map-size 64";
    succeed(directory, &format!("{large} -o whole.exr"))?;
    for (region, name) in [("0,0,4400,24", "a"), ("4400,0,200,24", "b"), ("4600,0,4400,24", "c")] {
        succeed(directory, &format!("{large} --region {region} -o {name}.exr"))?;
    }
    succeed(directory, "join a.exr b.exr c.exr -o joined.exr")?;
    let read = |name: &str| std::fs::read(directory.join(name));
    ensure(read("joined.exr")? == read("whole.exr")?, "parts of windows are others")?;
    let refined = format!("{large} --refine 2");
    succeed(directory, &format!("{refined} -o refined.exr"))?;
    for (index, region) in ["0,0,4400,24", "4400,0,4600,24"].into_iter().enumerate() {
        for set in ["0..0", "1..1"] {
            let part = format!("--region {region} --sets {set} -o p{index}-{}.exr", &set[..1]);
            succeed(directory, &format!("{refined} {part}"))?;
        }
    }
    succeed(directory, "join p0-0.exr p0-1.exr p1-0.exr p1-1.exr -o joined.exr")?;
    ensure(read("joined.exr")? == read("refined.exr")?, "light sets in windows are others")?;
    ensure(differ(&read("joined.exr")?, &read("whole.exr")?), "a second light set changes nothing")?;
    // It is the picture that a smaller one shows, and nothing is seen of where the windows meet.
    let small = "render pillars --size 2250x6 --lights 12 --engine gpu --map-size 64 --aa 4";
    succeed(directory, &format!("{small} -o small.exr"))?;
    let whole = girandole_reference::image_file::read(&directory.join("whole.exr"))?;
    let small = girandole_reference::image_file::read(&directory.join("small.exr"))?;
    let at = |x: usize, y: usize| whole.pixels[y * 9000 + x].y;
    let mean_of = |x: usize, y: usize| (0..16).map(|i| at(4 * x + i % 4, 4 * y + i / 4)).sum::<f32>() / 16.0;
    let error = |i: usize| {
        let expected = small.pixels[i].y;
        (mean_of(i % 2250, i / 2250) - expected).abs() / expected.max(0.05)
    };
    let mean = (0..2250 * 6).map(error).sum::<f32>() / 13500.0;
    let step = |x: usize| (0..24).map(|y| (at(x, y) - at(x - 1, y)).abs()).sum::<f32>() / 24.0;
    let beside = (4490..4511).filter(|&x| x != 4500).map(step).sum::<f32>() / 20.0;
    let said = format!("another picture: {mean}, {} where windows meet, {beside} beside", step(4500));
    ensure(mean < 0.01 && step(4500) < 2.0 * beside + 1e-4, &said)
}

fn no_parts(directory: &Path) -> Result<(), Failed> {
    let render = |more: &str| succeed(directory, &format!("{SMALL} {more}"));
    render("--refine 4 --sets 0..1 -o a.exr")?;
    render("--refine 4 --sets 2..3 -o b.exr")?;
    render("--refine 4 --sets 2..3 --seed 1 -o seed.exr")?;
    render("--refine 4 --sets 1..3 -o more.exr")?;
    render("--refine 4 --region 0,0,96,30 -o top.exr")?;
    render("--refine 4 --region 0,40,40,32 -o low.exr")?;
    render("--refine 4 --region 0,20,96,30 -o middle.exr")?;
    render("-o whole.exr")?;
    let bytes = std::fs::read(directory.join("b.exr"))?;
    std::fs::write(directory.join("cut.exr"), &bytes[..bytes.len() / 2])?;
    std::fs::write(directory.join("out.exr"), "it stays")?;
    for (parts, says) in [
        ("a.exr", "light sets 2..3"),
        ("b.exr", "light sets 0..1"),
        ("a.exr seed.exr", "with --seed 1 instead of 0"),
        ("a.exr more.exr", "the same pixels of the same light sets"),
        ("a.exr b.exr b.exr", "the same pixels of the same light sets"),
        ("top.exr", "the pixels 0,30,96,42 are missing"),
        ("top.exr low.exr", "the pixels 0,30,96,10 are missing"),
        ("top.exr middle.exr low.exr", "are in another part"),
        ("whole.exr", "is a whole picture"),
        ("a.exr cut.exr", "cut.exr"),
    ] {
        let output = girandole(directory, &format!("join {parts} -o out.exr"));
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        let is_refused = output.status.code() == Some(2) && said.lines().count() == 1 && said.contains(says);
        ensure(is_refused, &format!("{parts}: {said}"))?;
        ensure(std::fs::read(directory.join("out.exr"))? == b"it stays", "it is overwritten")?;
    }
    Ok(())
}

fn agrees_with_traced_shadows(directory: &Path) -> Result<(), Failed> {
    // So large that the one pixel where the torus stands on the table does not decide.
    let larger = SMALL.replace("96x72", "128x96 --aa off");
    succeed(directory, &format!("{larger} --mode naive -o gpu.exr"))?;
    succeed(directory, &format!("{larger} --mode vd -o vd.exr"))?;
    succeed(directory, &format!("{larger} -o full.exr"))?;
    succeed(directory, &format!("{} -o cpu.exr", larger.replace("gpu", "cpu")))?;
    succeed(directory, "compare cpu.exr gpu.exr --max-rel-mse 5e-4 --max-energy-error 0.0025")?;
    succeed(directory, "compare cpu.exr vd.exr --max-rel-mse 5e-4 --max-energy-error 0.0025")?;
    succeed(directory, "compare cpu.exr full.exr --max-rel-mse 4e-3 --max-energy-error 0.005")?;
    // Parabolic maps bend edges: the same bounds notice.
    succeed(directory, &format!("{larger} --shadow-map parabolic --map-size 16 -o parabolic.exr"))?;
    let bent = girandole(directory, "compare cpu.exr parabolic.exr --max-rel-mse 5e-4");
    ensure(bent.status.code() == Some(1), "a coarse parabolic map passes for traced shadows")
}

fn little_memory_gives_a_picture_and_a_sentence(directory: &Path) -> Result<(), Failed> {
    let said = |arguments: &str| -> Result<usize, Failed> {
        let output = girandole(directory, &format!("{SMALL} {arguments} -o little.exr"));
        ensure(output.status.success(), arguments)?;
        Ok(String::from_utf8_lossy(&output.stderr).matches("texels across instead of").count())
    };
    ensure(said("--memory 1")? == 1 && said("")? == 0, "who hears of smaller maps")?;
    ensure(said("--memory 1 --map-size 16")? == 0, "small maps that were asked for")?;
    succeed(directory, &format!("{} -o cpu.exr", SMALL.replace("gpu", "cpu")))?;
    succeed(directory, &format!("{SMALL} --memory 1 -o little.exr"))?;
    succeed(directory, "compare cpu.exr little.exr --max-rel-mse 0.03 --max-energy-error 0.02")?;
    Ok(())
}

fn statistics_name_passes_and_counts(directory: &Path) -> Result<(), Failed> {
    succeed(directory, &format!("{SMALL} --aa off --map-size 64 --stats s.json"))?;
    let stats: serde_json::Value = serde_json::from_slice(&std::fs::read(directory.join("s.json"))?)?;
    ensure(stats["engine"] == "gpu" && stats["maps"] == 48 && stats["map_size_texels"] == 64, "counts")?;
    ensure(stats["pairs"] == 96 * 72 * 48, "pairs")?;
    ensure((1..=48).contains(&stats["maps_drawn"].as_u64().unwrap_or_default()), "maps that were drawn")?;
    let number = |key: &str| stats[key].as_f64().ok_or_else(|| Failed::from(format!("no {key}")));
    for key in ["setup_ms", "atlas_bytes", "map_texels_drawn", "triangles_that_cannot_block"] {
        number(key)?;
    }
    // Why it is fast: where points were shaded, and what became of their pairs with lights.
    let sum = |keys: &[&str]| keys.iter().map(|k| number(k)).sum::<Result<f64, Failed>>();
    let states =
        ["looked_up", "unshadowed", "in_light_maps", "fully_blocked"].map(|s| format!("share_pairs_{s}"));
    let shares = sum(&states.each_ref().map(String::as_str))?;
    ensure((shares - 1.0).abs() < 1e-6, "the shares of pairs are not the whole")?;
    let steps = ["1", "2", "4", "8"].map(|s| format!("share_shaded_at_step_{s}"));
    let shaded = sum(&steps.each_ref().map(String::as_str))?;
    ensure(
        shaded > 0.015 && shaded < 0.9 && number("look_ups_per_pixel")? < 48.0,
        "the picture is not interpolated",
    )?;
    ensure(stats["mode"] == "full" && number("leaves")? > 10.0 && number("light_maps")? > 10.0, "receivers")?;
    ensure(number("map_texels_drawn")? > 0.0, "nothing is drawn")?;
    let parts = number("shadow_maps_ms")? + number("visibility_ms")? + number("shading_ms")?;
    ensure((number("frame_ms")? - parts).abs() < 1e-6, "a frame is not the sum of its parts")
}

fn maps_that_do_not_fit_are_refused(directory: &Path) -> Result<(), Failed> {
    let output = girandole(directory, &format!("{SMALL} --map-size 4096 --memory 1 -o p.png"));
    let said = String::from_utf8(output.stderr)?;
    ensure(output.status.code() == Some(2) && said.lines().count() == 1 && said.contains("--memory"), &said)?;
    ensure(!directory.join("p.png").exists(), "a picture is left behind")
}

fn bench_times_modes(directory: &Path) -> Result<(), Failed> {
    let files = "--csv times.csv --json times.json";
    let small = "--size 64x48 --lights 12,20 --repeat 2 --map-size 64";
    let output = succeed(directory, &format!("bench table gap {small} {files}"))?;
    let rows: Vec<serde_json::Map<String, serde_json::Value>> =
        serde_json::from_slice(&std::fs::read(directory.join("times.json"))?)?;
    ensure(rows.len() == 2 * 2 * 4, "not one row for each scene, number of lights and mode")?;
    let mut seen = Vec::new();
    for row in &rows {
        for key in
            ["frame_ms", "visibility_ms", "shadow_maps_ms", "ratio", "width", "height", "look_ups_per_pixel"]
        {
            let valid = row.get(key).and_then(|v| v.as_f64()).is_some_and(|x| x.is_finite() && x >= 0.0);
            ensure(valid, &format!("{key}: {row:?}"))?;
        }
        ensure(row.values().all(|v| !v.is_object() && !v.is_array()), "a row is not flat")?;
        seen.push((row["scene"].to_string(), row["lights"].as_u64(), row["mode"].to_string()));
    }
    seen.sort_unstable();
    seen.dedup();
    ensure(seen.len() == rows.len(), "a row is there twice")?;
    // Naive reads every map at every pixel; the others do not.
    let of = |mode: &str, key: &str| {
        let row = rows.iter().find(|r| r["mode"] == mode && r["lights"] == 20 && r["scene"] == "table");
        row.and_then(|r| r[key].as_f64()).ok_or_else(|| Failed::from(format!("no {key} of {mode}")))
    };
    ensure(of("naive", "look_ups_per_pixel")? == 20.0 && of("naive", "ratio")? == 1.0, "naive")?;
    ensure(of("vd", "look_ups_per_pixel")? < 20.0, "vd reads every map")?;
    ensure(of("full", "pairs_per_pixel")? < of("vd", "pairs_per_pixel")?, "full sums every pair")?;
    // The table and the CSV file have the same rows.
    let table = String::from_utf8(output.stdout)?;
    ensure(table.lines().count() == rows.len() + 1 && table.contains("lookups/px"), &table)?;
    let widths: Vec<usize> = table.lines().map(|line| line.chars().count()).collect();
    ensure(widths.iter().all(|w| *w == widths[0]), "the table's columns are not aligned")?;
    let csv = std::fs::read_to_string(directory.join("times.csv"))?;
    let columns = csv.lines().next().map_or(0, |line| line.split(',').count());
    let is_rectangular = csv.lines().all(|line| line.split(',').count() == columns);
    ensure(csv.lines().count() == rows.len() + 1 && is_rectangular && columns > 8, &csv)
}

fn frames_are_the_same_alone_and_in_sequence(directory: &Path) -> Result<(), Failed> {
    succeed(directory, &format!("{SMALL} --frames 0..2 --fps 1 -o f#.exr"))?;
    succeed(directory, &format!("{SMALL} --frames 2..2 --fps 1 -o alone#.exr"))?;
    let [first, last, alone] =
        ["f0", "f2", "alone2"].map(|name| std::fs::read(directory.join(format!("{name}.exr"))));
    let (first, last, alone) = (first?, last?, alone?);
    ensure(last == alone, "a frame alone is another one")?;
    ensure(differ(&last, &first), "nothing moves")?;
    // Its light samples are held: it is another picture than with those of the moment, of about the same light.
    succeed(directory, &format!("{SMALL} --time 2 -o still.exr"))?;
    succeed(directory, "compare still.exr f2.exr --max-energy-error 0.15")?;
    ensure(differ(&std::fs::read(directory.join("still.exr"))?, &last), "light samples are not held")
}

fn frames_of_a_budget(directory: &Path) -> Result<(), Failed> {
    let frames = |range: &str, name: &str, more: &str| {
        succeed(directory, &format!("{SMALL} --frames {range} --fps 2 {more} -o {name}#.exr"))
    };
    let read = |name: &str| std::fs::read(directory.join(format!("{name}.exr")));
    frames("0..4", "all", "")?;
    frames("0..4", "few", "--updates 9")?;
    ensure(!differ(&read("few0")?, &read("all0")?), "the first frame draws all maps")?;
    ensure(differ(&read("few4")?, &read("all4")?), "a budget changes nothing")?;
    frames("4..4", "alone", "--updates 9")?;
    ensure(read("alone4")? == read("few4")?, "a frame alone is another one")?;
    let kept = read("few4")?;
    std::fs::remove_file(directory.join("few2.exr"))?;
    std::fs::remove_file(directory.join("few4.exr"))?;
    frames("0..4", "few", "--updates 9")?;
    ensure(read("few4")? == kept, "a frame that was resumed is another one")?;
    frames("4..4", "young", "--updates 9 --max-map-age 0")?;
    ensure(!differ(&read("young4")?, &read("all4")?), "no age at all is no budget")
}

fn bench_times_motion(directory: &Path) -> Result<(), Failed> {
    let small = "--size 64x48 --lights 24 --repeat 2 --map-size 64 --object torus";
    let output =
        succeed(directory, &format!("bench pillars --moving --updates 0,6,all {small} --json t.json"))?;
    let rows: Vec<serde_json::Map<String, serde_json::Value>> =
        serde_json::from_slice(&std::fs::read(directory.join("t.json"))?)?;
    let of = |key: &str| -> Result<Vec<f64>, Failed> {
        let values = rows.iter().map(|row| row.get(key).and_then(|v| v.as_f64()).filter(|x| x.is_finite()));
        values.collect::<Option<_>>().ok_or_else(|| format!("no {key}").into())
    };
    let drawn = of("maps_drawn")?;
    ensure(drawn[0] == 0.0 && drawn[1] == 6.0 && drawn[2] > 6.0, &format!("maps: {drawn:?}"))?;
    let stale = of("maps_stale")?;
    ensure(stale[0] > 6.0 && stale[1] > 0.0 && stale[2] == 0.0, &format!("stale: {stale:?}"))?;
    let error = of("stale_map_error")?;
    ensure(error[0] > 0.0 && error[1] < error[0] && error[2] == 0.0, &format!("errors: {error:?}"))?;
    for key in ["frame_ms", "static_frame_ms", "moving_frame_ms", "update_ms", "visibility_ms"] {
        ensure(of(key)?.iter().all(|ms| *ms > 0.0), key)?;
    }
    ensure(of("share_map_texels_drawn")?.iter().all(|share| *share <= 1.0), "more than a full redraw draws")?;
    let table = String::from_utf8(output.stdout)?;
    ensure(table.lines().count() == 4 && table.contains("updates"), &table)?;
    let changed = of("light_maps_changed")?;
    let command = format!("bench pillars --moving --rewalk 200 {small} --json light.json --csv light.csv");
    succeed(directory, &command)?;
    let csv = std::fs::read_to_string(directory.join("light.csv"))?;
    ensure(csv.contains("mode,updates,rewalk,width") && csv.contains(",all,200,64,48,"), &csv)?;
    let rows: Vec<serde_json::Map<String, serde_json::Value>> =
        serde_json::from_slice(&std::fs::read(directory.join("light.json"))?)?;
    let follows = rows[0].get("light_maps_changed").and_then(|n| n.as_f64()).ok_or("no light maps")?;
    ensure(follows > 10.0 * changed[2] + 10.0, &format!("light maps: {changed:?}, {follows}"))
}
