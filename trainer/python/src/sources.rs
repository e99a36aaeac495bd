//! Materials for training and evaluation: sources and Python objects.

use std::path::PathBuf;
use std::sync::Arc;

use glimpse_materials::{Material, MaterialsAndShares, Source, Sources};
use pyo3::prelude::*;

use crate::error::{Result, reject};
use crate::material::{PyMaterial, Shared, parse_source, warn_of_gaps};

/// An argument `materials`, parsed but not read.
pub(crate) struct MaterialArgs {
    pub(crate) sources: Sources,
    /// All Python materials, which form one of the sources, and its index.
    objects: Vec<Arc<dyn Material>>,
    index: usize,
}

impl MaterialArgs {
    /// Parses a source, a material, or an iterable of both, and their shares of training.
    pub(crate) fn parse(argument: &Bound<'_, PyAny>, shares: &[f32]) -> Result<Self> {
        let is_single =
            argument.is_instance_of::<PyMaterial>() || argument.extract::<PathBuf>().is_ok();
        let items: Vec<_> = if is_single {
            vec![argument.clone()]
        } else {
            argument.try_iter()?.collect::<PyResult<_>>()?
        };
        let (mut sources, mut objects, mut index) = (Vec::new(), Vec::new(), 0);
        for item in items {
            if let Ok(material) = item.cast::<PyMaterial>() {
                objects.push(material.get().complete()?);
                if objects.len() > 1 {
                    continue;
                }
                index = sources.len();
                sources.push(Source(objects[0].name().to_owned()));
            } else {
                sources.push(parse_source(&item)?);
            }
        }
        if sources.is_empty() {
            return reject("materials is empty: pass a source, or a list of materials");
        }
        if objects.len() > 1 {
            sources[index] = Source(format!("{} materials of a program", objects.len()));
        }
        Ok(Self {
            sources: Sources::new(sources, shares)?,
            objects,
            index,
        })
    }

    /// Reads the materials.
    pub(crate) fn load(&self) -> Result<MaterialsAndShares> {
        let sources = self.sources.sources.iter().enumerate();
        let lists = sources.map(|(index, source)| {
            if index == self.index && !self.objects.is_empty() {
                let objects = self.objects.iter().cloned();
                return Ok(objects
                    .map(|material| Box::new(Shared(material)) as _)
                    .collect());
            }
            let materials = source.load()?;
            Python::attach(|py| {
                let mut all = materials.iter();
                all.try_for_each(|material| warn_of_gaps(py, &**material))
            })?;
            Ok(materials)
        });
        Ok(self.sources.join(lists.collect::<Result<_>>()?)?)
    }
}
