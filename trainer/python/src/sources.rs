//! Materials for training and evaluation: sources and Python objects.

use std::path::PathBuf;
use std::sync::Arc;

use glimpse_materials::{Material, MaterialsAndShares, Source, Sources};
use pyo3::prelude::*;

use crate::error::{Result, reject};
use crate::material::{PyMaterial, Shared, parse_source, warn_of_coverage};

/// A source, or the list of all Python materials.
enum Group {
    Source(Source),
    Materials(Vec<Arc<dyn Material>>),
}

/// An argument `materials`, parsed but not read.
pub(crate) struct MaterialArgs(Vec<Group>);

impl MaterialArgs {
    /// Parses a source, a material, or a sequence of both. All materials of a sequence form one group.
    pub(crate) fn parse(argument: &Bound<'_, PyAny>) -> Result<Self> {
        let mut groups = Vec::new();
        if argument.is_instance_of::<PyMaterial>() || argument.extract::<PathBuf>().is_ok() {
            add(&mut groups, argument)?;
        } else {
            for item in argument.try_iter()? {
                add(&mut groups, &item?)?;
            }
        }
        if groups.is_empty() {
            return reject("materials is empty: pass a source, or a list of materials");
        }
        Ok(Self(groups))
    }

    /// Returns the names of the sources and their shares of training.
    pub(crate) fn sources(&self, shares: &[f32]) -> Result<Sources> {
        let sources = self.0.iter().map(|group| match group {
            Group::Source(source) => source.clone(),
            Group::Materials(list) => match &list[..] {
                [material] => Source(material.name().to_owned()),
                materials => Source(format!("{} materials of a program", materials.len())),
            },
        });
        Ok(Sources::new(sources.collect(), shares)?)
    }

    /// Reads the materials.
    pub(crate) fn load(&self, sources: &Sources) -> Result<MaterialsAndShares> {
        let lists = self.0.iter().map(|group| match group {
            Group::Source(source) => {
                let materials = source.load()?;
                Python::attach(|py| {
                    let mut all = materials.iter();
                    all.try_for_each(|material| warn_of_coverage(py, &**material))
                })?;
                Ok(materials)
            }
            Group::Materials(list) => {
                let list = list.iter().cloned();
                Ok(list
                    .map(|material| Box::new(Shared(material)) as _)
                    .collect())
            }
        });
        let lists = lists.collect::<Result<_>>()?;
        Ok(sources.join(lists)?)
    }
}

fn add(groups: &mut Vec<Group>, item: &Bound<'_, PyAny>) -> Result<()> {
    let Ok(material) = item.cast::<PyMaterial>() else {
        groups.push(Group::Source(parse_source(item)?));
        return Ok(());
    };
    let material = material.get().complete()?;
    let list = groups.iter_mut().find_map(|group| match group {
        Group::Materials(list) => Some(list),
        Group::Source(_) => None,
    });
    match list {
        Some(list) => list.push(material),
        None => groups.push(Group::Materials(vec![material])),
    }
    Ok(())
}
