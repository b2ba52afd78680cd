//! The tracers as a whole: what they must agree on with one another and with closed forms.

mod adaptive;
mod agreement;
mod energy;
mod furnace;
mod repeatability;
mod rolling;
