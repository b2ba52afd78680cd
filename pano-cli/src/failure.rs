//! Errors as the user sees them: what is wrong, where, with the line of the scene file, and what to do about it.

use miette::{Diagnostic, LabeledSpan, MietteHandlerOpts, NamedSource, ReportHandler, SourceCode};
use pano_core::Error;
use std::fmt;

/// Why a command did not do what it was asked to.
#[derive(Debug)]
pub(crate) enum Failure {
    /// An input or output is at fault.
    Core(Box<Report>),
    /// Everything was reported already.
    Reported,
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        let source = match &error {
            Error::Scene(e) => Some(NamedSource::new(e.path.display().to_string(), e.text.clone())),
            _ => None,
        };
        Self::Core(Box::new(Report { error, source }))
    }
}

impl Failure {
    /// Prints the failure to stderr.
    pub(crate) fn print(&self) {
        match self {
            Self::Core(report) => crate::output::message(&format!("{:?}", Rendered(report))),
            Self::Reported => {}
        }
    }
}

/// An error with what miette needs to draw it.
#[derive(Debug)]
pub(crate) struct Report {
    error: Error,
    source: Option<NamedSource<String>>,
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.error.fmt(f)
    }
}

impl std::error::Error for Report {}

impl Diagnostic for Report {
    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        self.error.remedy().map(|remedy| Box::new(remedy) as _)
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.source.as_ref().map(|source| source as _)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let Error::Scene(e) = &self.error else { return None };
        Some(Box::new(std::iter::once(LabeledSpan::at(e.span.clone(), "here"))))
    }
}

/// Draws a report through miette's handler, which adapts to the terminal.
struct Rendered<'a>(&'a Report);

impl fmt::Debug for Rendered<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Lines are left whole, so that paths and places can be copied and searched for.
        MietteHandlerOpts::new().wrap_lines(false).build().debug(self.0, f)
    }
}
