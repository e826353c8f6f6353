//! Figures say what they show, and show it where it can be seen.

use roxmltree::{Document, Node};

use super::{attribute, named};

/// Size of a panel's title, axis labels and ticks, pixels.
const TITLE: &str = "14";
const LABEL: &str = "12";
const TICK: &str = "11";
/// What an axis label ends with.
const UNITS: [&str; 14] = [
    "m",
    "mm",
    "s",
    "N/m",
    "µV",
    "%",
    "% of maximum",
    "nats",
    "count",
    "number",
    "share right",
    "0 to 1",
    "0 start to 1 end",
    "no unit",
];

/// Checks every figure. Returns the ids of those with a panel, and how many panels there are.
pub(super) fn check(page: &Document) -> (Vec<String>, usize) {
    let mut with_panels = Vec::new();
    let mut count = 0;
    for figure in named(page.root(), "figure") {
        let id = attribute(figure, "id");
        let [heading] = named(figure, "h3")[..] else {
            panic!("{id} has not one title");
        };
        assert!(words(heading).starts_with("Figure "), "{id}");
        let panels = named(figure, "svg");
        let panels = panels
            .into_iter()
            .filter(|svg| svg.attribute("class") == Some("panel"));
        let panels: Vec<Node> = panels.collect();
        if panels.is_empty() {
            assert!(words(figure).contains("Not part of this run."), "{id}");
            continue;
        }
        let [caption] = named(figure, "figcaption")[..] else {
            panic!("{id} has not one caption");
        };
        assert!(words(caption).len() > 40, "{id}: {}", words(caption));
        for panel in &panels {
            labelled(*panel, id);
            visible(*panel, id);
        }
        count += panels.len();
        with_panels.push(id.to_owned());
    }
    (with_panels, count)
}

fn words(node: Node) -> String {
    node.descendants()
        .filter(Node::is_text)
        .filter_map(|text| text.text())
        .collect()
}

fn texts<'a, 'input>(panel: Node<'a, 'input>, size: &str) -> Vec<Node<'a, 'input>> {
    let all = named(panel, "text").into_iter();
    all.filter(|text| text.attribute("font-size") == Some(size))
        .collect()
}

/// A title, a label with unit on each axis, ticks.
fn labelled(panel: Node, id: &str) {
    let [title] = texts(panel, TITLE)[..] else {
        panic!("a panel of {id} has not one title");
    };
    let title = words(title);
    assert!(!title.trim().is_empty(), "{id}");
    assert_eq!(attribute(panel, "aria-label"), title, "{id}");

    let labels = texts(panel, LABEL);
    let (up, along): (Vec<Node>, Vec<Node>) = labels
        .into_iter()
        .partition(|label| label.has_attribute("transform"));
    let ([up], [along]) = (&up[..], &along[..]) else {
        panic!("{id}, {title}: not one label on each axis");
    };
    // Rows with names instead of numbers have no unit.
    let ticks = texts(panel, TICK);
    let beside = ticks
        .iter()
        .filter(|tick| tick.attribute("text-anchor") == Some("end"));
    let beside: Vec<String> = beside.map(|tick| words(*tick)).collect();
    let below = ticks.len() - beside.len();
    assert!(beside.len() >= 2 && below >= 2, "{id}, {title}: {beside:?}");
    let names = beside.iter().all(|tick| tick.parse::<f64>().is_err());
    for (label, names) in [(along, false), (up, names)] {
        let label = words(*label);
        let unit = UNITS
            .iter()
            .any(|unit| label.ends_with(&format!(", {unit}")));
        assert!(unit || names, "{id}, {title}: `{label}` has no unit");
    }
}

fn number(text: &str) -> f64 {
    let value: f64 = text.parse().unwrap_or_else(|_| panic!("`{text}`"));
    assert!(value.is_finite(), "{text}");
    value
}

/// A rectangle of the drawing, pixels.
struct Frame {
    x: (f64, f64),
    y: (f64, f64),
}

impl Frame {
    /// Of an element with x, y, width and height.
    fn of(rect: Node) -> Self {
        let at = |name| number(attribute(rect, name));
        let (x, y) = (at("x"), at("y"));
        Self {
            x: (x, x + at("width")),
            y: (y, y + at("height")),
        }
    }

    fn has(&self, x: f64, y: f64) -> bool {
        let inside = |v: f64, (low, high): (f64, f64)| v >= low - 0.5 && v <= high + 0.5;
        inside(x, self.x) && inside(y, self.y)
    }
}

/// Every mark is inside the drawing, and every curve inside its axes.
fn visible(panel: Node, id: &str) {
    let view: Vec<f64> = attribute(panel, "viewBox").split(' ').map(number).collect();
    let [0.0, 0.0, width, height] = view[..] else {
        panic!("{id}: {view:?}");
    };
    assert!(width > 100.0 && height > 100.0);
    let page = Frame {
        x: (0.0, width),
        y: (0.0, height),
    };
    let [clip] = named(panel, "clipPath")[..] else {
        panic!("{id}: a panel has not one pair of axes");
    };
    let axes = Frame::of(named(clip, "rect")[0]);
    let mut marks = 0;
    for node in panel.descendants().filter(Node::is_element) {
        let at = |name| number(attribute(node, name));
        let name = node.tag_name().name();
        let turned = node.has_attribute("transform");
        assert!(!turned || name == "text", "{id}: a <{name}> is moved");
        let points = match name {
            "path" => points(attribute(node, "d"), id),
            "line" => vec![(at("x1"), at("y1")), (at("x2"), at("y2"))],
            "circle" => vec![(at("cx"), at("cy"))],
            "text" => vec![(at("x"), at("y"))],
            // The whole drawing's background.
            "rect" if node.attribute("width") == Some("100%") => Vec::new(),
            "rect" => {
                let rect = Frame::of(node);
                vec![(rect.x.0, rect.y.0), (rect.x.1, rect.y.1)]
            }
            "svg" | "g" | "defs" | "clipPath" => Vec::new(),
            other => panic!("{id}: a <{other}> is not known to this test"),
        };
        let outside = points.iter().find(|(x, y)| !page.has(*x, *y));
        assert_eq!(outside, None, "{id}: <{name}> outside {view:?}");
        let curve = name == "path" && node.attribute("d").is_some_and(|d| !d.contains('Z'));
        let outside = points.iter().find(|(x, y)| curve && !axes.has(*x, *y));
        assert_eq!(outside, None, "{id}: a curve leaves its axes");
        let clipped = node
            .ancestors()
            .any(|above| above.has_attribute("clip-path"));
        marks += usize::from(clipped && !points.is_empty());
    }
    assert!(marks > 0, "{id}: an empty panel");
}

/// Corners of a path of straight lines.
fn points(path: &str, id: &str) -> Vec<(f64, f64)> {
    let straight = |c: char| "MLZ".contains(c) || "0123456789.-e ,".contains(c);
    assert!(path.chars().all(straight), "{id}: {path}");
    let numbers = path.split(|c: char| c == ' ' || c == ',' || "MLZ".contains(c));
    let numbers: Vec<f64> = numbers.filter(|n| !n.is_empty()).map(number).collect();
    assert!(
        !numbers.is_empty() && numbers.len().is_multiple_of(2),
        "{id}"
    );
    numbers.chunks_exact(2).map(|xy| (xy[0], xy[1])).collect()
}
