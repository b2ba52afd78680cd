//! Which effects a scene calls for, and why.
