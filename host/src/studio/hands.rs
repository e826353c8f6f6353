//! Whoever presses the buttons beside the page: a story, or a person at a terminal.

use super::story::{Story, Told};
use crate::live::{Act, View};

/// Sees what the page shows, and acts.
pub trait Hands {
    /// What is done now that this is seen.
    fn look(&mut self, view: &View) -> Vec<Act>;
    /// What happens, for people; none where nobody needs to be told.
    fn text(&self) -> Option<String> {
        None
    }
    /// Whether everything is done.
    fn over(&self) -> bool;
    /// What came of a story.
    fn told(&self) -> Option<Told> {
        None
    }
}

impl Hands for Story {
    fn look(&mut self, view: &View) -> Vec<Act> {
        Story::look(self, view)
    }

    fn text(&self) -> Option<String> {
        Some(Story::text(self))
    }

    fn over(&self) -> bool {
        Story::over(self)
    }

    fn told(&self) -> Option<Told> {
        Some(Story::told(self))
    }
}
