//! Runs every figure at toy scale, so that none rots; needs a graphics adapter.

use girandole_figures::bench::{Bench, Scale};
use girandole_figures::figures::{FIGURES, Figure};
use girandole_figures::report::{Outcome, Report, Verdict};
use std::collections::BTreeSet;

/// What has to be the same in each run: all but times, and sentences and plots that tell them.
fn repeatable(outcome: &Outcome) -> Vec<String> {
    let pictures = outcome.pictures.iter().map(|p| format!("{} {} {:?}", p.name, p.caption, p.rgb));
    let cells = outcome.tables.iter().flat_map(|table| {
        let is_time = |column: &String| column.ends_with(" ms") || column.ends_with(" s");
        let columns = (0..table.columns.len()).filter(move |&i| !is_time(&table.columns[i]));
        columns.map(move |i| {
            let cells = table.rows.iter().map(|row| row[i].as_str()).collect::<Vec<_>>().join(" ");
            format!("{} {}: {cells}", table.name, table.columns[i])
        })
    });
    pictures.chain(cells).collect()
}

/// The files of an experiment.
fn files(outcome: &Outcome) -> Vec<String> {
    let plots = outcome.plots.iter().map(|plot| format!("{}.svg", plot.name));
    let pictures = outcome.pictures.iter().map(|picture| format!("{}.png", picture.name));
    plots.chain(pictures).chain(outcome.tables.iter().map(|table| format!("{}.csv", table.name))).collect()
}

#[test]
fn every_figure_is_made_and_the_same_twice() {
    let folder = tempfile::tempdir().unwrap();
    let bench = Bench::new(None, Scale::Toy).unwrap();
    let mut report = Report::new(folder.path(), Vec::new()).unwrap();
    for figure in &FIGURES {
        let outcome = (figure.run)(&bench);
        let again = (figure.run)(&bench).unwrap();
        report.add(figure, &outcome, 0.0).unwrap();
        let outcome = outcome.unwrap();
        let id = figure.id;
        assert!(repeatable(&outcome) == repeatable(&again), "{id} is another one the second time");
        let mut files = files(&outcome);
        assert!(!files.is_empty(), "{id} shows nothing");
        files.sort();
        let twice = files.windows(2).find(|pair| pair[0] == pair[1]);
        assert_eq!(twice, None, "{id} gives two files one name");
        for (what, words) in [("seen", &outcome.seen), ("settings", &outcome.settings)] {
            assert!(!words.is_empty(), "{id} does not say its {what}");
        }
        if let Verdict::Differs(why) = &outcome.verdict {
            assert!(!why.is_empty(), "{id} differs, and does not say why");
        }
        for table in &outcome.tables {
            let is_full = table.rows.iter().all(|row| row.len() == table.columns.len());
            assert!(is_full && !table.rows.is_empty(), "the table {} of {id} has gaps", table.name);
        }
    }
    let page = std::fs::read_to_string(report.path()).unwrap();
    for figure in &FIGURES {
        assert!(
            page.contains(&format!("<section id=\"{}\">", figure.id)),
            "{} is not on the page",
            figure.id
        );
    }
    let links: Vec<&str> = page.split("src=\"").skip(1).filter_map(|rest| rest.split('"').next()).collect();
    assert!(links.len() >= FIGURES.len());
    for link in links {
        assert!(folder.path().join(link).metadata().unwrap().len() > 100, "{link} is empty");
    }
}

#[test]
fn a_figure_that_fails_is_named_on_the_page_beside_the_rest() {
    let folder = tempfile::tempdir().unwrap();
    let mut report = Report::new(folder.path(), Vec::new()).unwrap();
    let figure = |id| Figure { id, title: "t", thesis: "?", run: |_| Ok(Outcome::default()) };
    report.add(&figure("9-1"), &Err(anyhow::anyhow!("no <lamp>").context("opening")), 0.0).unwrap();
    report.add(&figure("9-2"), &Ok(Outcome { seen: "light".into(), ..Outcome::default() }), 0.0).unwrap();
    let page = std::fs::read_to_string(report.path()).unwrap();
    for words in [
        "<section id=\"9-1\">",
        "<b>Failed:</b> opening: no &lt;lamp&gt;",
        "<a href=\"#9-1\">9-1</a> <span class=failed>failed</span>",
        "<section id=\"9-2\">",
        "<b>Seen:</b> light",
    ] {
        assert!(page.contains(words), "{words} is not on {page}");
    }
}

#[test]
fn figures_have_names_of_their_own_in_the_thesiss_order() {
    let ids: BTreeSet<&str> = FIGURES.iter().map(|figure| figure.id).collect();
    assert_eq!(ids.len(), FIGURES.len());
    let number = |id: &str| -> Option<[u32; 2]> {
        let (chapter, figure) = id.split_once('-')?;
        Some([chapter.parse().ok()?, figure.parse().ok()?])
    };
    let numbers = FIGURES.map(|figure| number(figure.id).unwrap_or([u32::MAX; 2]));
    assert!(numbers.is_sorted(), "{numbers:?}");
}
