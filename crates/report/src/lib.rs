//! `report.html`: one self-contained file in which a person sees a run. Did it work, what does it look like, where is it
//! tight?
//!
//! A [`Recorder`] watches the check ([`Recorder::programmed`]) and the run ([`Recorder::judged`]) and keeps what a screen can
//! show: memory does not grow with the run. [`Recorder::write`] writes the page. What is drawn of a machine comes from its
//! kinematics here (`skeleton`); the page only interpolates between the kept rows.
//!
//! * `fan`: which rows are kept; `envelope`: extremes of every curve; `blocks`: which line when.
//! * `sample`, `programmed`: what a row and a corner of the path hold.
//! * `page`: the data as JSON, the page as text. `assets`: the page's markup, style and scripts, as plain files.

mod blocks;
mod encode;
mod envelope;
mod fan;
mod page;
mod programmed;
mod recorder;
mod sample;
mod skeleton;
mod workspace;

pub use recorder::Recorder;
