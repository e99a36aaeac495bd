//! Several sources of training materials, and the share of each.

use std::collections::HashMap;

use serde::{Deserialize, Serialize};

use crate::error::SourceError;
use crate::setting::Name;
use crate::{Material, Source};

/// Sources of materials, and the share of training tasks that each gets.
#[derive(Clone, Debug, PartialEq)]
pub struct Sources {
    sources: Vec<Source>,
    /// One share for each source, with sum 1. None if all materials have equal weight.
    shares: Option<Vec<f32>>,
}

/// The origin of materials.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Origin {
    /// Files of the user, or materials that a program defines.
    Files,
    /// Procedural materials of the trainer.
    BuiltIn,
}

/// The materials of one source and their share of the training tasks. They are consecutive in the list of all
/// materials.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SourceShare {
    /// The source's label.
    pub label: String,
    /// The origin of the materials.
    pub origin: Origin,
    /// The number of materials.
    pub materials: usize,
    /// The source's share of the training tasks. Tasks of added procedural materials do not count. The shares of all
    /// sources have sum 1.
    pub share: f32,
}

impl SourceShare {
    /// Returns the share of a single source: all tasks.
    #[must_use]
    pub fn single(source: &Source, materials: usize) -> Self {
        Self {
            label: source.label().to_owned(),
            origin: match source.is_built_in() {
                true => Origin::BuiltIn,
                false => Origin::Files,
            },
            materials,
            share: 1.0,
        }
    }
}

/// Materials of several sources, and the share of each source.
pub type MaterialsAndShares = (Vec<Box<dyn Material>>, Vec<SourceShare>);

/// Shares that do not fit the sources.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ShareError {
    /// The number of shares differs from that of sources.
    #[error(
        "the number of values of {share} is {shares}, and that of {materials} is {sources}; give one share for each source",
        share = Name("share"), materials = Name("materials")
    )]
    Count {
        /// The number of sources.
        sources: usize,
        /// The number of shares.
        shares: usize,
    },
    /// A share, or the sum of all shares, is not a positive finite number.
    #[error(
        "a value or the sum of {share} is {0}, and both must be finite and above 0; give smaller positive numbers, or \
         remove the source from {materials}", share = Name("share"), materials = Name("materials")
    )]
    NotPositive(f32),
    /// There is a share, but a single source.
    #[error(
        "{share} has no effect with a single source: remove it, or give several {materials}",
        share = Name("share"), materials = Name("materials")
    )]
    Single,
}

impl Sources {
    /// Combines sources in proportion to `shares`. Without shares, each source is weighted by its number of materials.
    ///
    /// # Errors
    /// If `shares` is neither empty nor a list of one positive finite number for each source, with a finite sum.
    pub fn new(sources: Vec<Source>, shares: &[f32]) -> Result<Self, ShareError> {
        let sum: f32 = shares.iter().sum();
        let mut numbers = shares.iter().chain(shares.first().map(|_| &sum));
        if let Some(number) = numbers.find(|number| !(**number > 0.0 && number.is_finite())) {
            return Err(ShareError::NotPositive(*number));
        }
        let shares = match shares {
            [] => None,
            [_] if sources.len() == 1 => return Err(ShareError::Single),
            shares if shares.len() == sources.len() => {
                Some(shares.iter().map(|share| share / sum).collect())
            }
            _ => {
                return Err(ShareError::Count {
                    sources: sources.len(),
                    shares: shares.len(),
                });
            }
        };
        Ok(Self { sources, shares })
    }

    /// Returns the sources.
    #[must_use]
    pub fn as_slice(&self) -> &[Source] {
        &self.sources
    }

    /// Returns the labels of the sources, with their shares if any were given.
    #[must_use]
    pub fn label(&self) -> String {
        let labels = self.sources.iter().map(Source::label);
        let labels: Vec<String> = match &self.shares {
            None => labels.map(str::to_owned).collect(),
            Some(shares) => {
                let labels_and_shares = labels.zip(shares);
                labels_and_shares
                    .map(|(label, share)| format!("{label} ({share:.3})"))
                    .collect()
            }
        };
        labels.join(" and ")
    }

    /// Reads the materials of all sources.
    ///
    /// # Errors
    /// If a source cannot be read, or two sources hold a material of the same name.
    pub fn load(&self) -> Result<MaterialsAndShares, SourceError> {
        let lists = self.sources.iter().map(Source::load);
        self.join(lists.collect::<Result<_, _>>()?)
    }

    /// Joins the materials of each source.
    ///
    /// # Errors
    /// If two sources hold a material of the same name.
    pub fn join(
        &self,
        lists: Vec<Vec<Box<dyn Material>>>,
    ) -> Result<MaterialsAndShares, SourceError> {
        let mut source_by_name: HashMap<String, &Source> = HashMap::new();
        for (source, list) in self.sources.iter().zip(&lists) {
            for material in list {
                if let Some(first) = source_by_name.insert(material.name().to_owned(), source) {
                    return Err(SourceError::DuplicateName {
                        name: material.name().to_owned(),
                        first: first.0.as_str().into(),
                        second: source.0.as_str().into(),
                    });
                }
            }
        }
        let total: usize = lists.iter().map(Vec::len).sum();
        let indexed = self.sources.iter().zip(&lists).enumerate();
        let source_shares = indexed.map(|(index, (source, list))| SourceShare {
            share: match &self.shares {
                Some(shares) => shares[index],
                None => list.len() as f32 / total as f32,
            },
            ..SourceShare::single(source, list.len())
        });
        let source_shares = source_shares.collect();
        Ok((lists.into_iter().flatten().collect(), source_shares))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sources(texts: &[&str]) -> Vec<Source> {
        texts.iter().map(|text| Source((*text).into())).collect()
    }

    #[test]
    fn shares_are_in_proportion() {
        let list = sources(&["procedural:30:1", "procedural:10:2"]);
        for (shares, expected) in [(&[][..], 0.75), (&[1.0, 3.0][..], 0.25)] {
            let sources = Sources::new(list.clone(), shares).expect("valid shares");
            let (materials, source_shares) = sources.load().expect("distinct names");
            assert_eq!(materials.len(), 40);
            assert_eq!(
                [source_shares[0].materials, source_shares[1].materials],
                [30, 10]
            );
            assert_eq!(
                [source_shares[0].share, source_shares[1].share],
                [expected, 1.0 - expected]
            );
        }
        let sources = Sources::new(list, &[1.0, 3.0]).expect("valid shares");
        assert_eq!(
            sources.label(),
            "procedural:30:1 (0.250) and procedural:10:2 (0.750)"
        );
    }

    #[test]
    fn rejects_wrong_shares_and_duplicate_names() {
        let list = sources(&["procedural:3", "procedural:4"]);
        for shares in [
            &[1.0][..],
            &[1.0, 1.0, 1.0],
            &[1.0, 0.0],
            &[1.0, f32::NAN],
            &[f32::MAX, f32::MAX],
        ] {
            Sources::new(list.clone(), shares).expect_err("invalid shares");
        }
        let sources = Sources::new(list, &[]).expect("no shares");
        let error = sources.load().err().expect("duplicate names");
        assert!(
            matches!(&error, SourceError::DuplicateName { name, .. } if name.starts_with("procedural-000")),
            "{error}"
        );
    }
}
