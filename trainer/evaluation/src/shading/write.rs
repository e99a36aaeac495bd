//! Files of shading models: a dictionary for Mitsuba, a glTF asset, a MaterialX document.

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use serde_json::{Map, Value, json};

use super::model::{Shading, ShadingModel};
use super::sphere_mesh::sphere_strip;
use crate::metrics::Metrics;

/// A sphere without vertices and material.
const TEMPLATE: &str = include_str!("sphere.gltf");

impl Shading {
    /// Writes the file of a material. glTF and MaterialX files state `metrics`, the errors against the material; Mitsuba's
    /// dictionary has no place for them.
    #[must_use]
    pub fn to_file(&self, material: &str, metrics: &Metrics) -> Vec<u8> {
        let text = match self.model {
            ShadingModel::Principled => to_text(&self.principled()),
            ShadingModel::Gltf => to_text(&self.gltf(material, metrics)),
            ShadingModel::OpenPbr => self.materialx(material, metrics),
        };
        text.into_bytes()
    }

    /// Returns the values by name: a number, or the three channels of a color.
    fn by_name(&self) -> Vec<(&'static str, Vec<f64>)> {
        let mut all: Vec<(&str, Vec<f64>)> = Vec::new();
        for (parameter, value) in self.model.parameters().iter().zip(&self.values) {
            match all.last_mut() {
                Some((name, list)) if *name == parameter.name => list.push(*value),
                _ => all.push((&parameter.name, vec![*value])),
            }
        }
        all
    }

    /// Returns the argument of `mitsuba.load_dict`.
    fn principled(&self) -> Value {
        let mut dictionary = Map::new();
        dictionary.insert("type".into(), json!("principled"));
        for (name, list) in self.by_name() {
            let value = match &list[..] {
                [number] => json!(number),
                color => json!({ "type": "rgb", "value": color }),
            };
            dictionary.insert(name.into(), value);
        }
        Value::Object(dictionary)
    }

    /// Returns an asset with a sphere of the material.
    fn gltf(&self, material: &str, metrics: &Metrics) -> Value {
        let (mut base, mut specular, mut clearcoat) = (Map::new(), Map::new(), Map::new());
        for (name, list) in self.by_name() {
            let group = match name {
                name if name.starts_with("specular") => &mut specular,
                name if name.starts_with("clearcoat") => &mut clearcoat,
                _ => &mut base,
            };
            let value = match (name, &list[..]) {
                ("baseColorFactor", [red, green, blue]) => json!([red, green, blue, 1.0]),
                (_, [number]) => json!(number),
                (_, color) => json!(color),
            };
            group.insert(name.into(), value);
        }
        let vertices = sphere_strip();
        let numbers = vertices.as_flattened().iter();
        let bytes: Vec<u8> = numbers.flat_map(|number| number.to_le_bytes()).collect();
        let data = BASE64_STANDARD.encode(&bytes);
        let mut asset = serde_json::from_str::<Value>(TEMPLATE).expect("the template is JSON");
        asset["asset"]["generator"] = generator().into();
        asset["nodes"][0]["name"] = material.into();
        let surface = &mut asset["materials"][0];
        surface["name"] = material.into();
        surface["pbrMetallicRoughness"] = base.into();
        surface["extensions"]["KHR_materials_clearcoat"] = clearcoat.into();
        surface["extensions"]["KHR_materials_specular"] = specular.into();
        surface["extras"] = json!({ "loss": metrics.loss, "delta_e": metrics.delta_e });
        asset["accessors"][0]["count"] = vertices.len().into();
        asset["bufferViews"][0]["byteLength"] = bytes.len().into();
        asset["buffers"][0]["byteLength"] = bytes.len().into();
        asset["buffers"][0]["uri"] = format!("data:application/octet-stream;base64,{data}").into();
        asset
    }

    fn materialx(&self, material: &str, metrics: &Metrics) -> String {
        let inputs = self.by_name().into_iter().map(|(name, list)| {
            let kind = if list.len() == 3 { "color3" } else { "float" };
            let list: Vec<String> = list.iter().map(f64::to_string).collect();
            let value = list.join(", ");
            format!("    <input name=\"{name}\" type=\"{kind}\" value=\"{value}\" />\n")
        });
        format!(
            include_str!("open_pbr.mtlx"),
            name = identifier(material),
            generator = generator(),
            loss = metrics.loss,
            delta_e = metrics.delta_e,
            inputs = inputs.collect::<String>(),
        )
    }
}

fn generator() -> String {
    format!("glimpse-trainer {}", env!("CARGO_PKG_VERSION"))
}

fn to_text(value: &Value) -> String {
    format!("{value:#}\n")
}

/// Returns a name of letters, digits and underscores that does not begin with a digit.
fn identifier(name: &str) -> String {
    let allowed = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    let name: String = name.chars().map(allowed).collect();
    if name.starts_with(|c: char| c.is_ascii_alphabetic()) {
        name
    } else {
        format!("material_{name}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_identifiers() {
        assert_eq!(identifier("gold"), "gold");
        assert_eq!(identifier("2 \"red\" <p>"), "material_2__red___p_");
        assert_eq!(identifier(""), "material_");
    }
}
