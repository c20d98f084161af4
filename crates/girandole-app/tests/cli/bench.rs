//! What `girandole bench` prints and writes.

use crate::{Girandole, stderr, stdout};
use serde_json::Value;

const SMALL: [&str; 14] = [
    "bench",
    "table",
    "gap",
    "--size",
    "64x48",
    "--lights",
    "12,20",
    "--repeat",
    "2",
    "--map-size",
    "64",
    "--csv",
    "times.csv",
    "--json",
];

#[test]
fn bench_times_modes_or_says_why_not() {
    let girandole = Girandole::new();
    let arguments = [&SMALL[..], &["times.json"]].concat();
    let output = girandole.run(&arguments);
    if girandole.run(&["info", "--require-adapter"]).status.code() != Some(0) {
        // Without an adapter there is nothing to time.
        assert_eq!(output.status.code(), Some(2));
        assert!(stderr(&output).contains("adapter") && girandole.files().is_empty());
        return;
    }
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let rows: Vec<serde_json::Map<String, Value>> =
        serde_json::from_slice(&girandole.bytes("times.json")).unwrap();
    assert_eq!(rows.len(), 2 * 2 * 4);
    let mut seen = Vec::new();
    for row in &rows {
        for key in
            ["frame_ms", "visibility_ms", "shadow_maps_ms", "ratio", "width", "height", "look_ups_per_pixel"]
        {
            assert!(row[key].as_f64().is_some_and(|x| x.is_finite() && x >= 0.0), "{key}: {row:?}");
        }
        assert!(row.values().all(|v| !v.is_object() && !v.is_array()), "flat");
        seen.push((
            row["scene"].as_str().unwrap(),
            row["lights"].as_u64().unwrap(),
            row["mode"].as_str().unwrap(),
        ));
    }
    seen.sort_unstable();
    seen.dedup();
    assert_eq!(seen.len(), rows.len());
    // Naive reads every map at every pixel; the others do not.
    let of = |mode: &str, key: &str| {
        rows.iter().find(|r| r["mode"] == mode && r["lights"] == 20 && r["scene"] == "table").unwrap()[key]
            .as_f64()
    };
    assert_eq!(of("naive", "look_ups_per_pixel"), Some(20.0));
    assert!(of("vd", "look_ups_per_pixel") < of("naive", "look_ups_per_pixel"));
    assert!(of("full", "pairs_per_pixel") < of("vd", "pairs_per_pixel"));
    assert_eq!(of("naive", "ratio"), Some(1.0));
    // The table and the CSV file have the same rows.
    let table = stdout(&output);
    assert_eq!(table.lines().count(), rows.len() + 1, "{table}");
    let csv = String::from_utf8(girandole.bytes("times.csv")).unwrap();
    assert_eq!(csv.lines().count(), rows.len() + 1);
    let columns = csv.lines().next().unwrap().split(',').count();
    assert!(csv.lines().all(|line| line.split(',').count() == columns) && columns > 8, "{csv}");
}
