//! The rendering methods a scene can ask for.

use std::{fmt, str::FromStr};

/// `render.method`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Method {
    /// Chosen from what the scene holds: with depth, `dpt` for stills and `iprt` for sequences; without depth but with a
    /// proxy or a ground, `dpt` for HDR and `mr360` for LDR.
    #[default]
    Auto,
    /// Panoramic ray tracing in the RGBD panorama, sparse and filtered.
    Iprt,
    /// Delta path tracing: only the radiance that the objects change.
    Dpt,
    /// Image-based lighting and shadowing for LDR 360° video.
    Mr360,
    /// Single-pass recursive ray tracing with ghost objects.
    Rt2ar,
    /// Baseline: environment light, no interaction with the place.
    Ibl,
    /// Baseline: one-pass differential path tracing.
    Onepass,
    /// Baseline: differential rendering in two passes.
    Twopass,
}

impl Method {
    /// Every method.
    pub const ALL: [Self; 8] =
        [Self::Auto, Self::Iprt, Self::Dpt, Self::Mr360, Self::Rt2ar, Self::Ibl, Self::Onepass, Self::Twopass];

    /// Scattering events after the camera where nothing is said: for `rt2ar`, whose rays branch at clear and mirroring surfaces
    /// only, enough to get into and out of a body that is in another one and to be reflected twice.
    pub const fn default_bounces(self) -> u32 {
        match self {
            Self::Rt2ar => 6,
            _ => 3,
        }
    }

    /// Its name in scene files and on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Iprt => "iprt",
            Self::Dpt => "dpt",
            Self::Mr360 => "mr360",
            Self::Rt2ar => "rt2ar",
            Self::Ibl => "ibl",
            Self::Onepass => "onepass",
            Self::Twopass => "twopass",
        }
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Method {
    type Err = crate::Error;

    /// Parses [`Method::name`].
    fn from_str(name: &str) -> crate::Result<Self> {
        Self::ALL.into_iter().find(|m| m.name() == name).ok_or_else(|| {
            let names = Self::ALL.map(Self::name).join(", ");
            crate::Error::argument(format!("unknown method `{name}`: methods are {names}"))
        })
    }
}
