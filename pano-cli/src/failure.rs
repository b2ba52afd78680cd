//! Errors as the user sees them: what is wrong, where, with the line of the scene file, and what to do about it.

use miette::{Diagnostic, LabeledSpan, MietteHandlerOpts, NamedSource, ReportHandler, SourceCode};
use pano_compose::pipeline;
use std::{fmt, ops::Range};

/// Why a command did not do what it was asked to.
#[derive(Debug)]
pub(crate) enum Failure {
    /// Something is at fault.
    Report(Box<Report>),
    /// Everything was reported already.
    Reported,
}

impl From<pano_core::Error> for Failure {
    fn from(error: pano_core::Error) -> Self {
        let help = error.remedy().map(str::to_owned);
        let message = error.to_string();
        let excerpt = match error {
            pano_core::Error::Scene(e) => Some((NamedSource::new(e.path.display().to_string(), e.text), e.span)),
            _ => None,
        };
        Self::Report(Box::new(Report { message, help, excerpt }))
    }
}

impl From<pipeline::Error> for Failure {
    fn from(error: pipeline::Error) -> Self {
        match error {
            pipeline::Error::Core(error) => error.into(),
            other => Self::Report(Box::new(Report {
                message: other.to_string(),
                help: other.remedy().map(str::to_owned),
                excerpt: None,
            })),
        }
    }
}

impl Failure {
    /// Prints the failure to stderr.
    pub(crate) fn print(&self) {
        match self {
            Self::Report(report) => crate::output::message(&format!("{:?}", Rendered(report))),
            Self::Reported => {}
        }
    }
}

/// What miette draws.
#[derive(Debug)]
pub(crate) struct Report {
    message: String,
    help: Option<String>,
    /// A scene file and the bytes at fault.
    excerpt: Option<(NamedSource<String>, Range<usize>)>,
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Report {}

impl Diagnostic for Report {
    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        self.help.as_ref().map(|help| Box::new(help) as _)
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.excerpt.as_ref().map(|(source, _)| source as _)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let (_, span) = self.excerpt.as_ref()?;
        Some(Box::new(std::iter::once(LabeledSpan::at(span.clone(), "here"))))
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
