//! `modelDescription.xml`: FMI 2.0.4, section 2.2, and FMI 3.0.1, section 2.4.

use std::fmt::Write as _;

use super::variables::{FmuKind, FmuStart, FmuVariable, Role};

/// FMI version that an FMU describes; the library implements both versions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FmiVersion {
    /// 2.0.
    Two,
    /// 3.0.
    Three,
}

hoid_model::named_choice!(FmiVersion, "version of FMI", 2, {
    Two => "2",
    Three => "3",
});

/// Name of the library in an FMU.
pub(super) const MODEL_IDENTIFIER: &str = "hoid";
/// Units, each with its nonzero exponents of the SI base units and rad, and its factor if this is not 1.
const UNIT_DEFINITIONS: [(&str, &str); 3] = [
    ("s", r#"s="1""#),
    ("rad/s", r#"s="-1" rad="1""#),
    ("deg", r#"rad="1" factor="0.017453292519943295""#),
];

impl FmuKind {
    /// Returns the token that the description and the library share: the version of hoid and the kind of FMU.
    pub fn token(self) -> String {
        format!("hoid-{}-{}", env!("CARGO_PKG_VERSION"), self.name())
    }

    fn help(self) -> &'static str {
        match self {
            Self::Tracker => "A person who controls a machine, estimated sample by sample from e and u",
            Self::Operator => "A simulated person who controls a machine: e in, u out",
        }
    }
}

/// Returns the description of an FMU with sample time `step_s`.
pub(super) fn description(version: FmiVersion, kind: FmuKind, variables: &[FmuVariable], step_s: f64) -> String {
    let mut xml = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    let (token, help, hoid) = (kind.token(), kind.help(), env!("CARGO_PKG_VERSION"));
    let (fmi, token_name, unit_tag) = match version {
        FmiVersion::Two => ("2.0", "guid", "BaseUnit"),
        FmiVersion::Three => ("3.0", "instantiationToken", "BaseUnit"),
    };
    let _ = writeln!(
        xml,
        "<fmiModelDescription fmiVersion=\"{fmi}\" modelName=\"hoid.{kind}\" {token_name}=\"{token}\" description=\"{help}\" \
         version=\"{hoid}\" generationTool=\"hoid {hoid}\" variableNamingConvention=\"flat\"{}>",
        match version {
            FmiVersion::Two => " numberOfEventIndicators=\"0\"",
            FmiVersion::Three => "",
        }
    );
    let state = match version {
        FmiVersion::Two => "FMUstate",
        FmiVersion::Three => "FMUState",
    };
    let _ = writeln!(
        xml,
        "  <CoSimulation modelIdentifier=\"{MODEL_IDENTIFIER}\" canHandleVariableCommunicationStepSize=\"true\" \
         canGetAndSet{state}=\"true\" canSerialize{state}=\"true\"/>"
    );
    xml.push_str("  <UnitDefinitions>\n");
    for (name, exponents) in UNIT_DEFINITIONS {
        let _ = writeln!(xml, "    <Unit name=\"{name}\"><{unit_tag} {exponents}/></Unit>");
    }
    xml.push_str("  </UnitDefinitions>\n");
    let _ = writeln!(xml, "  <DefaultExperiment startTime=\"0\" stepSize=\"{step_s}\"/>");
    xml.push_str("  <ModelVariables>\n");
    for (reference, variable) in variables.iter().enumerate() {
        match version {
            FmiVersion::Two => write_scalar_variable(&mut xml, reference, variable),
            FmiVersion::Three => write_typed_variable(&mut xml, reference, variable),
        }
    }
    if version == FmiVersion::Three {
        let _ = writeln!(
            xml,
            "    <Float64 name=\"time\" valueReference=\"{}\" causality=\"independent\" variability=\"continuous\" unit=\"s\" \
             description=\"time\"/>",
            variables.len()
        );
    }
    xml.push_str("  </ModelVariables>\n  <ModelStructure>\n");
    let outputs = || {
        let all = variables.iter().enumerate();
        all.filter(|(_, variable)| variable.role == Role::Output)
            .map(|(reference, _)| reference)
    };
    match version {
        FmiVersion::Two => {
            for (open, close) in [("<Outputs>", "</Outputs>"), ("<InitialUnknowns>", "</InitialUnknowns>")] {
                let _ = writeln!(xml, "    {open}");
                for reference in outputs() {
                    // Indices in the description start at one.
                    let index = reference.saturating_add(1);
                    let _ = writeln!(xml, "      <Unknown index=\"{index}\" dependencies=\"\"/>");
                }
                let _ = writeln!(xml, "    {close}");
            }
        }
        FmiVersion::Three => {
            for tag in ["Output", "InitialUnknown"] {
                for reference in outputs() {
                    let _ = writeln!(xml, "    <{tag} valueReference=\"{reference}\" dependencies=\"\"/>");
                }
            }
        }
    }
    xml.push_str("  </ModelStructure>\n</fmiModelDescription>\n");
    xml
}

/// Returns the attributes causality and variability.
fn attributes(variable: &FmuVariable) -> &'static str {
    match variable.role {
        Role::Parameter => "causality=\"parameter\" variability=\"fixed\" initial=\"exact\"",
        Role::Input => "causality=\"input\" variability=\"discrete\"",
        Role::Output => "causality=\"output\" variability=\"discrete\" initial=\"calculated\"",
    }
}

fn unit_attribute(variable: &FmuVariable) -> String {
    if variable.unit.is_empty() {
        String::new()
    } else {
        format!(" unit=\"{}\"", variable.unit)
    }
}

fn write_scalar_variable(xml: &mut String, reference: usize, variable: &FmuVariable) {
    let start = |text: String| match variable.role {
        Role::Output => String::new(),
        Role::Parameter | Role::Input => format!(" start=\"{text}\""),
    };
    let typed = match &variable.start {
        FmuStart::Real(value) => format!("<Real{}{}/>", unit_attribute(variable), start(value.to_string())),
        FmuStart::Integer(value) => format!("<Integer{}/>", start(value.to_string())),
        FmuStart::Boolean(value) => format!("<Boolean{}/>", start(value.to_string())),
        FmuStart::Text(text) => format!("<String{}/>", start(escape_xml(text))),
    };
    let _ = writeln!(
        xml,
        "    <ScalarVariable name=\"{}\" valueReference=\"{reference}\" description=\"{}\" {}>{typed}</ScalarVariable>",
        variable.name,
        variable.help,
        attributes(variable)
    );
}

fn write_typed_variable(xml: &mut String, reference: usize, variable: &FmuVariable) {
    let start = |text: String| match variable.role {
        Role::Output => String::new(),
        Role::Parameter | Role::Input => format!(" start=\"{text}\""),
    };
    let attributes = format!(
        "name=\"{}\" valueReference=\"{reference}\" description=\"{}\" {}",
        variable.name,
        variable.help,
        attributes(variable)
    );
    let _ = match &variable.start {
        FmuStart::Real(value) => writeln!(
            xml,
            "    <Float64 {attributes}{}{}/>",
            unit_attribute(variable),
            start(value.to_string())
        ),
        FmuStart::Integer(value) => writeln!(xml, "    <Int32 {attributes}{}/>", start(value.to_string())),
        FmuStart::Boolean(value) => writeln!(xml, "    <Boolean {attributes}{}/>", start(value.to_string())),
        FmuStart::Text(text) => writeln!(
            xml,
            "    <String {attributes}><Start value=\"{}\"/></String>",
            escape_xml(text)
        ),
    };
}

/// Escapes text for use in an attribute.
fn escape_xml(text: &str) -> String {
    let mut all = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => all.push_str("&amp;"),
            '<' => all.push_str("&lt;"),
            '>' => all.push_str("&gt;"),
            '"' => all.push_str("&quot;"),
            '\n' => all.push_str("&#10;"),
            '\r' => all.push_str("&#13;"),
            '\t' => all.push_str("&#9;"),
            other => all.push(other),
        }
    }
    all
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn descriptions_are_xml_with_every_variable_once() {
        for kind in FmuKind::ALL {
            let mut variables = kind.variables();
            for variable in &mut variables {
                if variable.name == "options" {
                    variable.start = FmuStart::Text("{\"a\": \"<&\n\"}".to_owned());
                }
            }
            for version in FmiVersion::ALL {
                let xml = description(version, kind, &variables, 0.01);
                let parsed = roxmltree::Document::parse(&xml).unwrap();
                let root = parsed.root_element();
                let named: Vec<&str> = (root.descendants())
                    .filter(|node| node.attribute("causality").is_some_and(|c| c != "independent"))
                    .filter_map(|node| node.attribute("name"))
                    .collect();
                assert_eq!(named, variables.iter().map(|v| v.name).collect::<Vec<_>>());
                let of = |role: Role| variables.iter().filter(|v| v.role == role).count();
                let unknowns = root
                    .descendants()
                    .filter(|node| node.attribute("dependencies").is_some());
                assert_eq!(unknowns.count(), 2 * of(Role::Output));
                let texts = root
                    .descendants()
                    .filter_map(|node| node.attribute("start").or(node.attribute("value")));
                assert_eq!(
                    texts.filter(|text| *text == "{\"a\": \"<&\n\"}").count(),
                    usize::from(kind == FmuKind::Tracker)
                );
            }
        }
    }
}
