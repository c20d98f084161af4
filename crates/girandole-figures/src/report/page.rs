//! The page of a report, and the files beside it.

use super::{Outcome, Verdict};
use crate::figures::Figure;
use anyhow::Result;
use girandole_core::files;
use girandole_reference::image_file::write_png;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// A page in a folder, and the files of its figures in folders below it. Written after each figure, so that it can be
/// looked at before all are done.
pub struct Report {
    folder: PathBuf,
    /// Machine, adapter, version and scale, as headings and words.
    made_on: Vec<(String, String)>,
    sections: Vec<Section>,
}

struct Section {
    id: String,
    /// What the list of figures says of it.
    word: &'static str,
    html: String,
}

impl Report {
    /// An empty one.
    ///
    /// # Errors
    /// Where the folder cannot be made.
    pub fn new(folder: &Path, made_on: Vec<(String, String)>) -> Result<Self> {
        std::fs::create_dir_all(folder)?;
        Ok(Self { folder: folder.into(), made_on, sections: Vec::new() })
    }

    /// The page.
    pub fn path(&self) -> PathBuf {
        self.folder.join("index.html")
    }

    /// Adds what an experiment gave, or why it failed, and writes the page.
    ///
    /// # Errors
    /// Where a file cannot be written, or a plot cannot be drawn.
    pub fn add(&mut self, figure: &Figure, outcome: &Result<Outcome>, seconds: f64) -> Result<()> {
        let mut html = format!("<h2>{}</h2>\n", heading(figure));
        let _ = writeln!(html, "<p><b>Asked:</b> {}</p>", escape(figure.thesis));
        let word = match outcome {
            Ok(outcome) => {
                let word = self.verdict(&mut html, outcome);
                self.files(&mut html, figure.id, outcome)?;
                let _ =
                    writeln!(html, "<p class=how>{} Made in {seconds:.0} s.</p>", escape(&outcome.settings));
                word
            }
            Err(error) => {
                let _ =
                    writeln!(html, "<p class=differs><b>Failed:</b> {}</p>", escape(&format!("{error:#}")));
                "failed"
            }
        };
        self.sections.push(Section { id: figure.id.into(), word, html });
        files::write(&self.path(), self.page().as_bytes())?;
        Ok(())
    }

    fn verdict(&self, html: &mut String, outcome: &Outcome) -> &'static str {
        let _ = writeln!(html, "<p><b>Seen:</b> {}</p>", escape(&outcome.seen));
        match &outcome.verdict {
            Verdict::Agrees => {
                html.push_str("<p class=agrees>It agrees.</p>\n");
                "agrees"
            }
            Verdict::Differs(why) => {
                let _ = writeln!(html, "<p class=differs><b>It differs:</b> {}</p>", escape(why));
                "differs"
            }
            Verdict::Shown => "shown",
        }
    }

    fn files(&self, html: &mut String, id: &str, outcome: &Outcome) -> Result<()> {
        let folder = self.folder.join(id);
        std::fs::create_dir_all(&folder)?;
        html.push_str("<div class=row>\n");
        for picture in &outcome.pictures {
            let [width, height] = picture.size;
            let file = format!("{}.png", picture.name);
            write_png(&folder.join(&file), width, height, &picture.rgb)?;
            let caption = escape(&picture.caption);
            let _ = writeln!(
                html,
                "<figure><img src=\"{id}/{file}\" width={width} height={height} alt=\"{caption}\"><figcaption>{caption}</figcaption></figure>"
            );
        }
        for plot in &outcome.plots {
            let svg = plot.svg()?;
            files::write(&folder.join(format!("{}.svg", plot.name)), svg.as_bytes())?;
            let (name, title) = (&plot.name, escape(&plot.title));
            let _ = writeln!(html, "<figure><img src=\"{id}/{name}.svg\" alt=\"{title}\"></figure>");
        }
        html.push_str("</div>\n");
        for table in &outcome.tables {
            let file = format!("{}.csv", table.name);
            files::write(&folder.join(&file), table.csv().as_bytes())?;
            let _ = writeln!(
                html,
                "<table><caption>{} (<a href=\"{id}/{file}\">CSV</a>)</caption>",
                escape(&table.caption)
            );
            for (cells, tag) in
                std::iter::once((&table.columns, "th")).chain(table.rows.iter().map(|r| (r, "td")))
            {
                let cells: String =
                    cells.iter().map(|cell| format!("<{tag}>{}</{tag}>", escape(cell))).collect();
                let _ = writeln!(html, "<tr>{cells}</tr>");
            }
            html.push_str("</table>\n");
        }
        Ok(())
    }

    fn page(&self) -> String {
        let made_on = self.made_on.iter().fold(String::new(), |mut out, (heading, words)| {
            let _ = writeln!(out, "<tr><th>{}</th><td>{}</td></tr>", escape(heading), escape(words));
            out
        });
        let list = self.sections.iter().fold(String::new(), |mut out, Section { id, word, .. }| {
            let _ = writeln!(out, "<li><a href=\"#{id}\">{id}</a> <span class={word}>{word}</span></li>");
            out
        });
        let sections = self.sections.iter().fold(String::new(), |mut out, Section { id, html, .. }| {
            let _ = writeln!(out, "<section id=\"{id}\">\n{html}</section>");
            out
        });
        include_str!("page.html")
            .replace("@MADE_ON@", &made_on)
            .replace("@LIST@", &list)
            .replace("@SECTIONS@", &sections)
    }
}

fn heading(figure: &Figure) -> String {
    let is_number = figure.id.starts_with(|c: char| c.is_ascii_digit());
    let kind = if is_number { format!("Figure {}: ", figure.id) } else { String::new() };
    format!("{kind}{}", escape(figure.title))
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
