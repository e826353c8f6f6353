//! The page: sections, figures and tables with an anchor each, contents on top, nothing loaded from anywhere.

use std::fmt::Write as _;

use super::chart::{Board, Key, Mark, Panel, Shape};

const STYLE: &str = include_str!("page.css");

/// A figure: panels under one legend, and what is seen on them.
#[derive(Debug, Default)]
pub(super) struct Figure {
    /// Its anchor.
    pub(super) id: &'static str,
    pub(super) title: String,
    pub(super) caption: String,
    pub(super) keys: Vec<Key>,
    pub(super) panels: Vec<Panel>,
    pub(super) boards: Vec<Board>,
    /// Panels beside each other, where the page is wide enough.
    pub(super) columns: usize,
}

/// One cell of a table.
#[derive(Debug)]
pub(super) enum Cell {
    Text(String),
    /// A number of the results: its path in their JSON document, itself, and how it is shown.
    Number {
        key: String,
        value: String,
        shown: String,
    },
}

/// A table: its first row is the header, the first column names the rows.
#[derive(Debug)]
pub(super) struct Table {
    pub(super) id: &'static str,
    pub(super) title: String,
    pub(super) caption: String,
    pub(super) header: Vec<String>,
    pub(super) rows: Vec<Vec<Cell>>,
}

/// A page under construction.
#[derive(Debug)]
pub(super) struct Page {
    title: String,
    lead: String,
    contents: String,
    body: String,
    figures: usize,
    tables: usize,
    open: bool,
}

impl Page {
    pub(super) fn new(title: &str, lead: &str) -> Self {
        Self {
            title: title.to_owned(),
            lead: lead.to_owned(),
            contents: String::new(),
            body: String::new(),
            figures: 0,
            tables: 0,
            open: false,
        }
    }

    /// Begins a section.
    pub(super) fn section(&mut self, id: &str, heading: &str, text: &str) {
        self.close();
        self.open = true;
        let heading = escaped(heading);
        let _ = write!(self.contents, "<li><a href=\"#{id}\">{heading}</a>\n<ul>\n");
        let _ = write!(
            self.body,
            "<section id=\"{id}\">\n<h2>{heading}</h2>\n<p>{}</p>\n",
            escaped(text)
        );
    }

    /// Adds a figure; one without anything to draw says so.
    pub(super) fn figure(&mut self, figure: &Figure) {
        self.figures += 1;
        let (id, number) = (figure.id, self.figures);
        let title = format!("Figure {number}. {}", escaped(&figure.title));
        self.entry(id, &title);
        let _ = write!(
            self.body,
            "<figure id=\"{id}\">\n<h3><a href=\"#{id}\">{title}</a></h3>\n{}",
            legend(&figure.keys)
        );
        let panels = figure.panels.iter().enumerate();
        let panels = panels.filter_map(|(i, panel)| panel.svg(&format!("{id}-{i}")));
        let boards = figure.boards.iter().enumerate();
        let boards = boards.filter_map(|(i, board)| board.svg(&format!("{id}-b{i}")));
        let drawn: Vec<String> = boards.chain(panels).collect();
        let columns = figure.columns.max(1);
        let _ = writeln!(self.body, "<div class=\"panels columns-{columns}\">");
        for svg in &drawn {
            let _ = writeln!(self.body, "<div>{svg}</div>");
        }
        if drawn.is_empty() {
            self.body.push_str("<p>Not part of this run.</p>\n");
        }
        let caption = escaped(&figure.caption);
        let _ = write!(
            self.body,
            "</div>\n<figcaption>{caption}</figcaption>\n</figure>\n"
        );
    }

    /// Adds a table.
    pub(super) fn table(&mut self, table: &Table) {
        self.tables += 1;
        let (id, number) = (table.id, self.tables);
        let title = format!("Table {number}. {}", escaped(&table.title));
        self.entry(id, &title);
        let _ = write!(
            self.body,
            "<div class=\"table\" id=\"{id}\">\n<h3><a href=\"#{id}\">{title}</a></h3>\n"
        );
        self.grid(&table.header, &table.rows);
        let _ = write!(
            self.body,
            "<p class=\"caption\">{}</p>\n</div>\n",
            escaped(&table.caption)
        );
    }

    fn grid(&mut self, header: &[String], rows: &[Vec<Cell>]) {
        self.body.push_str("<table>\n<thead><tr>");
        for name in header {
            let _ = write!(self.body, "<th scope=\"col\">{}</th>", escaped(name));
        }
        self.body.push_str("</tr></thead>\n<tbody>\n");
        for row in rows {
            self.body.push_str("<tr>");
            for (column, cell) in row.iter().enumerate() {
                self.body.push_str(&match cell {
                    Cell::Text(text) if column == 0 => {
                        format!("<th scope=\"row\">{}</th>", escaped(text))
                    }
                    Cell::Text(text) => format!("<td>{}</td>", escaped(text)),
                    Cell::Number { key, value, shown } => format!(
                        "<td class=\"number\" data-key=\"{}\" data-value=\"{}\">{}</td>",
                        escaped(key),
                        escaped(value),
                        escaped(shown)
                    ),
                });
            }
            self.body.push_str("</tr>\n");
        }
        self.body.push_str("</tbody>\n</table>\n");
    }

    fn entry(&mut self, id: &str, title: &str) {
        let _ = writeln!(self.contents, "<li><a href=\"#{id}\">{title}</a></li>");
    }

    fn close(&mut self) {
        if self.open {
            self.contents.push_str("</ul></li>\n");
            self.body.push_str("</section>\n");
        }
        self.open = false;
    }

    /// The whole document: HTML that is well-formed XML too.
    pub(super) fn finish(mut self) -> String {
        self.close();
        let title = escaped(&self.title);
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n\
             <meta name=\"color-scheme\" content=\"light dark\"/>\n<title>{title}</title>\n\
             <style>\n{STYLE}</style>\n</head>\n<body>\n<header>\n<h1>{title}</h1>\n<p>{}</p>\n</header>\n\
             <nav id=\"contents\" aria-label=\"Contents\">\n<h2>Contents</h2>\n<ul>\n{}</ul>\n</nav>\n\
             <main>\n{}</main>\n</body>\n</html>\n",
            escaped(&self.lead),
            self.contents,
            self.body
        )
    }
}

fn legend(keys: &[Key]) -> String {
    if keys.is_empty() {
        return String::new();
    }
    let mut list = "<ul class=\"keys\">\n".to_owned();
    for Key { mark, label } in keys {
        let _ = writeln!(
            list,
            "<li><svg class=\"key\" viewBox=\"0 0 34 14\" aria-hidden=\"true\">{}</svg>{}</li>",
            drawn(*mark),
            escaped(label)
        );
    }
    list + "</ul>\n"
}

/// The mark as its series has it.
fn drawn(mark: Mark) -> String {
    match mark {
        Mark::Line(ink, stroke, width) => format!(
            "<line x1=\"1\" y1=\"7\" x2=\"33\" y2=\"7\" stroke=\"{}\" stroke-width=\"{width}\" \
             stroke-dasharray=\"{}\"/>",
            ink.css(),
            stroke.dashes()
        ),
        Mark::Band(ink, opacity) => format!(
            "<rect x=\"1\" y=\"1\" width=\"32\" height=\"12\" fill=\"{}\" fill-opacity=\"{opacity}\"/>",
            ink.css()
        ),
        Mark::Dots(ink, shape, _) => {
            let css = ink.css();
            match shape {
                Shape::Circle => format!("<circle cx=\"17\" cy=\"7\" r=\"4\" fill=\"{css}\"/>"),
                Shape::Square => {
                    format!("<rect x=\"13\" y=\"3\" width=\"8\" height=\"8\" fill=\"{css}\"/>")
                }
                Shape::Triangle => format!("<path d=\"M17 2 L22 11 L12 11 Z\" fill=\"{css}\"/>"),
                Shape::Diamond => {
                    format!("<path d=\"M17 2 L22 7 L17 12 L12 7 Z\" fill=\"{css}\"/>")
                }
                Shape::Cross => format!(
                    "<path d=\"M13 3 L21 11 M21 3 L13 11\" stroke=\"{css}\" stroke-width=\"2\"/>"
                ),
            }
        }
    }
}

/// Text as it may stand in an element or an attribute.
pub(super) fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            other => out.push(other),
        }
    }
    out
}
