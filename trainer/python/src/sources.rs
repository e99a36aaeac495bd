//! Materials for training and judging: of sources and of Python's own.

use std::path::PathBuf;
use std::sync::Arc;

use glimpse_materials::{Joined, Material, Source, SourceError, Sources};
use pyo3::prelude::*;

use crate::error::{raised, refused};
use crate::material::{PyMaterial, Shared, source_of};

/// Materials that belong together.
enum Group {
    Source(Source),
    Given(Vec<Arc<dyn Material>>),
}

/// What was given as materials, not yet read.
pub(crate) struct Given(Vec<Group>);

impl Given {
    /// Of a source, a material, or a sequence of both, in which materials are one group.
    pub(crate) fn of(given: &Bound<'_, PyAny>) -> PyResult<Self> {
        let mut groups = Vec::new();
        if given.is_instance_of::<PyMaterial>() || given.extract::<PathBuf>().is_ok() {
            add(&mut groups, given)?;
        } else {
            for each in given.try_iter()? {
                add(&mut groups, &each?)?;
            }
        }
        match groups.is_empty() {
            true => refused("there are no materials: give a source, or a list of materials"),
            false => Ok(Self(groups)),
        }
    }

    /// What they are called, and in what proportion training takes them.
    pub(crate) fn sources(&self, shares: &[f32]) -> PyResult<Sources> {
        let sources = self.0.iter().map(|group| match group {
            Group::Source(source) => source.clone(),
            Group::Given(list) => match &list[..] {
                [one] => Source(one.name().to_owned()),
                more => Source(format!("{} materials of a program", more.len())),
            },
        });
        Sources::new(sources.collect(), shares).map_err(raised)
    }

    /// Reads them.
    pub(crate) fn load(&self, sources: &Sources) -> Result<Joined, SourceError> {
        let lists = self.0.iter().map(|group| match group {
            Group::Source(source) => source.load(),
            Group::Given(list) => Ok(list.iter().map(shared).collect()),
        });
        sources.join(lists.collect::<Result<_, _>>()?)
    }
}

fn shared(material: &Arc<dyn Material>) -> Box<dyn Material> {
    Box::new(Shared(material.clone()))
}

fn add(groups: &mut Vec<Group>, given: &Bound<'_, PyAny>) -> PyResult<()> {
    let Ok(material) = given.cast::<PyMaterial>() else {
        groups.push(Group::Source(source_of(given)?));
        return Ok(());
    };
    let material = material.get().material.clone();
    let found = groups.iter_mut().find_map(|group| match group {
        Group::Given(list) => Some(list),
        Group::Source(_) => None,
    });
    match found {
        Some(list) => list.push(material),
        None => groups.push(Group::Given(vec![material])),
    }
    Ok(())
}
