//! Seeds of tensor files with few nodes.

use glimpse_core::geometry::Angles;
use glimpse_materials::Material;

use crate::{SeedResult, Seeds};

/// A tensor file: name, type, shape and bytes of each field.
#[derive(Clone)]
pub(crate) struct Tensors(Vec<(String, u8, Vec<u64>, Vec<u8>)>);

impl Tensors {
    fn push(&mut self, name: &str, shape: &[u64], values: &[f32]) {
        let bytes = values
            .iter()
            .flat_map(|value| value.to_le_bytes())
            .collect();
        self.0.push((name.to_owned(), 10, shape.to_vec(), bytes));
    }

    pub(crate) fn bytes(&self) -> Vec<u8> {
        let header = self
            .0
            .iter()
            .map(|(name, _, shape, _)| 13 + name.len() + 8 * shape.len());
        let mut offset = 18 + header.sum::<usize>();
        let mut bytes = b"tensor_file\0\x01\0".to_vec();
        bytes.extend((self.0.len() as u32).to_le_bytes());
        for (name, kind, shape, values) in &self.0 {
            bytes.extend((name.len() as u16).to_le_bytes());
            bytes.extend(name.as_bytes());
            bytes.extend((shape.len() as u16).to_le_bytes());
            bytes.push(*kind);
            bytes.extend((offset as u64).to_le_bytes());
            bytes.extend(shape.iter().flat_map(|length| length.to_le_bytes()));
            offset += values.len();
        }
        bytes.extend(self.0.iter().flat_map(|(.., values)| values));
        bytes
    }

    /// Returns the bytes with one field changed.
    fn with(&self, name: &str, change: impl Fn(&mut (String, u8, Vec<u64>, Vec<u8>))) -> Vec<u8> {
        let mut changed = self.clone();
        changed
            .0
            .iter_mut()
            .filter(|field| field.0 == name)
            .for_each(change);
        changed.bytes()
    }
}

/// Returns the fields of a material's measurement, with few nodes.
pub(crate) fn tensors(material: &dyn Material) -> Tensors {
    let theta_i = [0.0_f32, 0.6, 1.5];
    let brdf = |theta_d: f32, theta_h: f32| {
        material.brdf(Angles {
            theta_h,
            theta_d,
            phi_d: 0.3,
        })
    };
    let mut rgb = Vec::new();
    for theta in theta_i {
        for channel in 0..3 {
            rgb.extend((0..6).map(|node| brdf(0.9 * theta, 0.1 * node as f32)[channel]));
        }
    }
    let mut tensors = Tensors(vec![
        ("description".into(), 1, vec![4], b"seed".to_vec()),
        ("jacobian".into(), 1, vec![1], vec![1]),
    ]);
    tensors.push("phi_i", &[1], &[0.0]);
    tensors.push("theta_i", &[3], &theta_i);
    tensors.push("ndf", &[2, 4], &[0.4, 0.3, 0.2, 0.1, 0.4, 0.3, 0.2, 0.1]);
    tensors.push("sigma", &[2, 2], &[1.0, 0.5, 1.0, 0.5]);
    tensors.push("vndf", &[1, 3, 2, 2], &[0.25; 12]);
    tensors.push("rgb", &[1, 3, 3, 2, 3], &rgb);
    tensors
}

/// Writes seeds of the reader `material`: the byte that selects a name `*.bsdf`, then a tensor file.
pub(crate) fn rgl(seeds: &Seeds, tensors: &Tensors) -> SeedResult {
    let write = |name: &str, bytes: Vec<u8>| seeds.write(name, [&[1][..], &bytes].concat());
    seeds.write_lengths("rgl", &[&[1][..], &tensors.bytes()].concat())?;
    let mut big_endian = tensors.bytes();
    big_endian[14..18].reverse();
    write("rgl-big-endian", big_endian)?;
    write(
        "rgl-spectral",
        tensors.with("rgb", |field| field.0 = "spectra".into()),
    )?;
    write(
        "rgl-anisotropic",
        tensors.with("phi_i", |field| {
            field.2 = vec![3];
            field.3 = vec![0; 12];
        }),
    )?;
    write(
        "rgl-double",
        tensors.with("ndf", |field| {
            field.1 = 11;
            field.2 = vec![2, 2];
        }),
    )?;
    write(
        "rgl-shape-overflow",
        tensors.with("ndf", |field| field.2 = vec![1 << 63, 2]),
    )?;
    write(
        "rgl-size-overflow",
        tensors.with("ndf", |field| field.2 = vec![1 << 32, 1 << 32]),
    )?;
    write(
        "rgl-none",
        tensors.with("vndf", |field| field.2 = vec![1, 3, 0, 1 << 40]),
    )?;
    for (name, value) in [
        ("nan", f32::NAN),
        ("infinite", f32::INFINITY),
        ("negative", -1.0),
        ("huge", f32::MAX),
    ] {
        for field in ["theta_i", "ndf", "sigma", "vndf", "rgb"] {
            let bytes = tensors.with(field, |field| {
                field.3[4..8].copy_from_slice(&value.to_le_bytes())
            });
            write(&format!("rgl-{name}-{field}"), bytes)?;
        }
    }
    Ok(())
}
