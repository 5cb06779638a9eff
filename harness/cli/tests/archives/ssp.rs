//! SSP archives.

use crate::relay::{fmu, folder, run, zipped, Ran, FREE};

/// A description of a system: namespaces of the standard, what is inside its System, and after it.
fn ssd(version: &str, system: &str, after: &str) -> String {
    format!(
        r#"<?xml version="1.0" encoding="UTF-8"?>
<ssd:SystemStructureDescription xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription"
  xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon" xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues"
  xmlns:ssm="http://ssp-standard.org/SSP1/SystemStructureParameterMapping" version="{version}" name="x">
<ssd:System name="x">{system}</ssd:System>{after}
</ssd:SystemStructureDescription>"#
    )
}

/// A gain of 1 from u to y, in metres, its u settable by k and n.
fn part() -> Vec<u8> {
    fmu(
        (FREE, "stepSize=\"0.1\""),
        &[
            "Real.0 input u unit=\"m\" start=\"0\"",
            "Real.1 parameter k unit=\"m\" start=\"1\"",
            "Integer.0 parameter n start=\"1\"",
            "Real.10 output y unit=\"m\"",
            "Real.11 output got_k unit=\"m\"",
            "Integer.10 output got_n",
            "Real.20 output tolerance",
        ],
    )
}

fn ran(files: &[(&str, &[u8])]) -> Ran {
    let archive = zipped(&[files, &[("resources/part.fmu", &part()[..])]].concat());
    let dir = folder(&[("x.ssp", &archive)]);
    run(dir.path(), "x.ssp", &["--stop", "0.3"])
}

fn system(inside: &str) -> Ran {
    ran(&[("SystemStructure.ssd", ssd("1.0", inside, "").as_bytes())])
}

fn set(parameters: &str) -> String {
    format!(
        "<ssv:ParameterSet version=\"1.0\" name=\"s\"><ssv:Parameters>{parameters}</ssv:Parameters></ssv:ParameterSet>"
    )
}

fn bound(prefix: &str, parameters: &str) -> String {
    let set = set(parameters);
    format!("<ssd:ParameterBinding prefix=\"{prefix}\"><ssd:ParameterValues>{set}</ssd:ParameterValues></ssd:ParameterBinding>")
}

fn bindings(inside: &str) -> String {
    format!("<ssd:ParameterBindings>{inside}</ssd:ParameterBindings>")
}

fn real(name: &str, value: &str) -> String {
    format!("<ssv:Parameter name=\"{name}\"><ssv:Real value=\"{value}\"/></ssv:Parameter>")
}

fn component(name: &str, inside: &str) -> String {
    format!("<ssd:Component name=\"{name}\" source=\"resources/part.fmu\">{inside}</ssd:Component>")
}

fn connectors(list: &[(&str, &str, &str)]) -> String {
    let each = |(name, kind, unit): &(&str, &str, &str)| {
        let unit = if unit.is_empty() { String::new() } else { format!(" unit=\"{unit}\"") };
        format!("<ssd:Connector name=\"{name}\" kind=\"{kind}\"><ssc:Real{unit}/></ssd:Connector>")
    };
    format!("<ssd:Connectors>{}</ssd:Connectors>", list.iter().map(each).collect::<String>())
}

fn connection(start: (&str, &str), end: (&str, &str), more: &str) -> String {
    let element = |side: &str, name: &str| match name {
        "" => String::new(),
        name => format!("{side}Element=\"{name}\" "),
    };
    format!(
        "<ssd:Connection {}startConnector=\"{}\" {}endConnector=\"{}\" {more}</ssd:Connection>",
        element("start", start.0),
        start.1,
        element("end", end.0),
        end.1
    )
}

fn connections(inside: &str) -> String {
    format!("<ssd:Connections>{inside}</ssd:Connections>")
}

#[test]
fn the_binding_of_the_higher_level_wins_and_of_one_level_the_later_one() {
    let own = bindings(&bound("", &(real("k", "1") + &real("n", "3"))));
    let inner = component("a", &own);
    let middle = bindings(&(bound("a.", &real("k", "2")) + &bound("", &real("a.k", "3"))));
    let sub = format!("<ssd:System name=\"sub\">{middle}<ssd:Elements>{inner}</ssd:Elements></ssd:System>");
    let r = system(&format!("<ssd:Elements>{sub}</ssd:Elements>"));
    assert_eq!((r.code, r.last("sub/a.got_k"), r.last("sub/a.got_n")), (Some(0), 3.0, 3.0), "{}", r.said);
    let top = bindings(&bound("sub.", &real("a.k", "4")));
    let r = system(&format!("{top}<ssd:Elements>{sub}</ssd:Elements>"));
    assert_eq!(r.last("sub/a.got_k"), 4.0, "{}", r.said);
    // a name that nothing has is not passed over in silence
    let top = bindings(&bound("", &(real("sub.b.k", "4") + &real("sub.a.kk", "5"))));
    let r = system(&format!("{top}<ssd:Elements>{sub}</ssd:Elements>"));
    assert_eq!(r.code, Some(0), "{}", r.said);
    assert!(r.said.contains("sub.b.k, sub.a.kk: the system has no parameter of that name"), "{}", r.said);
}

#[test]
fn values_of_system_connectors_reach_the_parameters_they_are_connected_to() {
    let ports = connectors(&[("length", "parameter", "mm"), ("push", "input", "")]);
    let values = bindings(&bound("", &(real("length", "50") + &real("push", "2"))));
    let wires = connection(("", "length"), ("a", "k"), ">") + &connection(("a", "u"), ("", "push"), ">");
    let inside = format!("{ports}{values}<ssd:Elements>{}</ssd:Elements>{}", component("a", ""), connections(&wires));
    let units = "<ssd:Units><ssc:Unit name=\"mm\"><ssc:BaseUnit m=\"1\" factor=\"0.001\"/></ssc:Unit></ssd:Units>";
    let r = ran(&[("SystemStructure.ssd", ssd("1.0", &inside, units).as_bytes())]);
    assert_eq!((r.code, r.last("a.got_k"), r.last("a.y")), (Some(0), 0.05, 2.0), "{}", r.said);
}

/// A part inside a system inside the system, fed through connectors at both, and written from either side.
#[test]
fn systems_inside_systems_are_one_and_units_and_transformations_add_up_on_the_way() {
    let inner_ports = connectors(&[("in", "input", "mm"), ("out", "output", "")]);
    let wires = connection(("a", "u"), ("", "in"), ">") + &connection(("a", "y"), ("", "out"), ">");
    let sub = |name: &str| {
        let elements = format!("<ssd:Elements>{}</ssd:Elements>", component("a", ""));
        format!("<ssd:System name=\"{name}\">{inner_ports}{elements}{}</ssd:System>", connections(&wires))
    };
    let linear = "><ssc:LinearTransformation factor=\"2\" offset=\"10\"/>";
    let outer = connection(("s1", "in"), ("source", "y"), linear)
        + &connection(("s1", "out"), ("s2", "in"), ">")
        + &connection(("s2", "out"), ("raw", "u"), "suppressUnitConversion=\"true\">");
    let value = bindings(&bound("", &real("u", "3")));
    let elements = component("source", &value) + &component("raw", "") + &sub("s1") + &sub("s2");
    let inside = format!("<ssd:Elements>{elements}</ssd:Elements>{}", connections(&outer));
    let units = "<ssd:Units><ssc:Unit name=\"mm\"><ssc:BaseUnit m=\"1\" factor=\"0.001\"/></ssc:Unit></ssd:Units>";
    for version in ["1.0", "2.0"] {
        let r = ran(&[("SystemStructure.ssd", ssd(version, &inside, units).as_bytes())]);
        assert_eq!(r.code, Some(0), "{}", r.said);
        // 3 m are 3000 mm, twice that and 10 mm are 6.01 m
        assert_eq!((r.last("s1/a.y"), r.last("s2/a.y"), r.last("raw.y")), (6.01, 6.01, 6.01), "{}", r.said);
    }
}

#[test]
fn parameter_mappings_rename_convert_and_transform_what_they_name() {
    let ssv = r#"<ssv:ParameterSet xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues"
      xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon" version="1.0" name="s"><ssv:Parameters>
      <ssv:Parameter name="gap"><ssv:Real value="50" unit="mm"/></ssv:Parameter>
      <ssv:Parameter name="raw"><ssv:Real value="50" unit="mm"/></ssv:Parameter>
      <ssv:Parameter name="gear"><ssv:Integer value="2"/></ssv:Parameter>
      <ssv:Parameter name="k"><ssv:Real value="9"/></ssv:Parameter></ssv:Parameters>
      <ssv:Units><ssc:Unit name="mm"><ssc:BaseUnit m="1" factor="0.001"/></ssc:Unit></ssv:Units></ssv:ParameterSet>"#;
    let ssm = r#"<m:ParameterMapping xmlns:m="http://ssp-standard.org/SSP1/SystemStructureParameterMapping"
      xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon" version="1.0">
      <m:MappingEntry source="gap" target="a.k"><ssc:LinearTransformation factor="2"/></m:MappingEntry>
      <m:MappingEntry source="raw" target="b.k" suppressUnitConversion="true"><ssc:LinearTransformation factor="0.01"/></m:MappingEntry>
      <m:MappingEntry source="gear" target="b.n"><ssc:IntegerMappingTransformation><ssc:MapEntry source="2" target="40"/>
        </ssc:IntegerMappingTransformation></m:MappingEntry></m:ParameterMapping>"#;
    let binding = "<ssd:ParameterBinding source=\"parameters/values%20of%20mine.ssv\"><ssd:ParameterMapping source=\"./parameters/map.ssm\"/>\
                   </ssd:ParameterBinding>";
    let elements = component("a", "") + &component("b", "");
    let inside = format!("{}<ssd:Elements>{elements}</ssd:Elements>", bindings(binding));
    let r = ran(&[
        ("SystemStructure.ssd", ssd("1.0", &inside, "").as_bytes()),
        ("parameters/values of mine.ssv", ssv.as_bytes()),
        ("parameters/map.ssm", ssm.as_bytes()),
    ]);
    assert_eq!(r.code, Some(0), "{}", r.said);
    let got = ["a.got_k", "b.got_k", "b.got_n", "a.got_n"].map(|n| r.last(n));
    assert_eq!(got, [0.1, 0.5, 40.0, 0.0], "{}", r.said);
    assert!(!r.said.contains("no parameter"), "what a mapping leaves out is left out on purpose: {}", r.said);
    // a unit that cannot be converted never becomes the number as it is
    let wrong = ssv.replace(
        "unit=\"mm\"/></ssv:Parameter>\n      <ssv:Parameter name=\"raw\"",
        "unit=\"furlong\"/></ssv:Parameter>\n      <ssv:Parameter name=\"raw\"",
    );
    let r = ran(&[
        ("SystemStructure.ssd", ssd("1.0", &inside, "").as_bytes()),
        ("parameters/values of mine.ssv", wrong.as_bytes()),
        ("parameters/map.ssm", ssm.as_bytes()),
    ]);
    assert_eq!((r.code, r.rows.len()), (Some(2), 0), "{}", r.said);
    assert!(
        r.said.contains("values of mine.ssv:3: parameter k: its unit and that of k are furlong, which is not"),
        "{}",
        r.said
    );
}

#[test]
fn a_signal_dictionary_hands_on_what_goes_into_it() {
    let dictionary = r#"<ssd:SignalDictionaries><ssd:SignalDictionary name="bus"><ssb:SignalDictionary version="1.0"
      xmlns:ssb="http://ssp-standard.org/SSP1/SystemStructureSignalDictionary">
      <ssb:DictionaryEntry name="way"><ssc:Real unit="mm"/></ssb:DictionaryEntry><ssb:Units>
      <ssc:Unit name="mm"><ssc:BaseUnit m="1" factor="0.001"/></ssc:Unit></ssb:Units></ssb:SignalDictionary>
      </ssd:SignalDictionary></ssd:SignalDictionaries>"#;
    let reference = |name: &str| {
        let ports = connectors(&[("way", "inout", "")]);
        format!(
            "<ssd:SignalDictionaryReference name=\"{name}\" dictionary=\"bus\">{ports}</ssd:SignalDictionaryReference>"
        )
    };
    let value = bindings(&bound("", &real("u", "3")));
    let sub = format!(
        "<ssd:System name=\"sub\"><ssd:Elements>{}{}</ssd:Elements>{}</ssd:System>",
        reference("inner"),
        component("b", ""),
        connections(&connection(("b", "u"), ("inner", "way"), ">"))
    );
    let elements = component("a", &value) + &reference("outer") + &sub;
    let wires = connections(&connection(("a", "y"), ("outer", "way"), ">"));
    let r = system(&format!("<ssd:Elements>{elements}</ssd:Elements>{wires}{dictionary}"));
    assert_eq!((r.code, r.last("sub/b.y")), (Some(0), 3.0), "{}", r.said);
}

#[test]
fn steps_and_tolerances_of_annotations_are_taken_and_a_step_is_chosen_where_nothing_says_one() {
    let inside = format!("<ssd:Elements>{}</ssd:Elements>", component("a", ""));
    let osp = r#"<ssd:DefaultExperiment startTime="1" stopTime="2"><ssd:Annotations><ssc:Annotation type="com.opensimulationplatform">
      <osp:Algorithm xmlns:osp="http://opensimulationplatform.com/SSP/OSPAnnotations"><osp:FixedStepAlgorithm baseStepSize="0.05"/>
      </osp:Algorithm></ssc:Annotation></ssd:Annotations></ssd:DefaultExperiment>"#;
    let archive = |after: &str, part: &[u8]| {
        let ssd = ssd("1.0", &inside, after);
        folder(&[("x.ssp", &zipped(&[("SystemStructure.ssd", ssd.as_bytes()), ("resources/part.fmu", part)]))])
    };
    let dir = archive(osp, &part());
    let r = run(dir.path(), "x.ssp", &[]);
    assert_eq!((r.code, r.rows.len(), r.rows[0][0], r.last("time")), (Some(0), 21, 1.0, 2.0), "{}", r.said);
    let oms = r#"<ssd:Annotations><ssc:Annotation type="org.openmodelica"><oms:FixedStepMaster xmlns:oms="o" stepSize="0.25"
      relativeTolerance="1e-6"/></ssc:Annotation></ssd:Annotations>"#;
    let r = run(archive(oms, &part()).path(), "x.ssp", &[]);
    assert_eq!((r.rows.len(), r.last("a.tolerance")), (5, 1e-6), "{}", r.said);
    // an FMU that prefers no step
    let silent = fmu((FREE, "stopTime=\"4\""), &["Real.21 output steps"]);
    let r = run(archive("", &silent).path(), "x.ssp", &[]);
    assert_eq!((r.code, r.last("time"), r.last("a.steps")), (Some(0), 4.0, 800.0), "{}", r.said);
    assert!(r.said.contains("no step is given and no FMU prefers one: 0.005 s is taken"), "{}", r.said);
}

#[test]
fn what_is_wrong_in_an_archive_is_named_with_its_place() {
    let two = component("a", "") + &component("b", "");
    for (inside, says) in [
        (
            format!("<ssd:Elements>{two}</ssd:Elements>{}", connections(&connection(("a", "y"), ("bb", "u"), ">"))),
            "element \"bb\" is not known; known are a, b",
        ),
        (
            format!("<ssd:Elements>{}</ssd:Elements>", two.replace("name=\"b\"", "name=\"a\"")),
            "two elements are named a",
        ),
        (format!("<ssd:Elements>{}</ssd:Elements>", two.replace("resources", "../..")), "no path inside the archive"),
        (
            format!(
                "<ssd:Elements>{two}</ssd:Elements>{}",
                connections(&connection(("a", "y"), ("b", "u"), "startIndices=\"1\">"))
            ),
            "a connection of array elements",
        ),
    ] {
        let r = system(&inside);
        assert_eq!((r.code, r.rows.len()), (Some(2), 0), "{}", r.said);
        assert!(r.said.contains(says) && r.said.contains("SystemStructure.ssd:"), "{}", r.said);
    }
    let r = ran(&[("SystemStructure.ssd", ssd("3.0", "", "").as_bytes())]);
    assert!(r.said.contains("this host reads SSP 1.0 and 2.0"), "{}", r.said);
}

#[test]
fn a_unit_that_an_fmu_only_names_is_converted_and_one_that_the_archive_alone_declares_too() {
    let inches = fmu((FREE, "stepSize=\"0.1\""), &["Real.0 parameter u start=\"0\"", "Real.10 output y unit=\"in\""]);
    let bare = fmu((FREE, "stepSize=\"0.1\""), &["Real.0 parameter u start=\"0\"", "Real.10 output y"]);
    let of = |name: &str, inside: &str| {
        let value = bindings(&bound("", &real("u", "2")));
        format!("<ssd:Component name=\"{name}\" source=\"resources/{name}.fmu\">{inside}{value}</ssd:Component>")
    };
    let declared = connectors(&[("y", "output", "mm")]);
    let elements = of("inches", "") + &of("bare", &declared) + &component("a", "") + &component("b", "");
    let wires = connection(("inches", "y"), ("a", "u"), ">") + &connection(("bare", "y"), ("b", "u"), ">");
    let inside = format!("<ssd:Elements>{elements}</ssd:Elements>{}", connections(&wires));
    let units = "<ssd:Units><ssc:Unit name=\"mm\"><ssc:BaseUnit m=\"1\" factor=\"0.001\"/></ssc:Unit></ssd:Units>";
    let r = ran(&[
        ("SystemStructure.ssd", ssd("1.0", &inside, units).as_bytes()),
        ("resources/inches.fmu", &inches),
        ("resources/bare.fmu", &bare),
    ]);
    assert_eq!((r.code, r.last("a.y"), r.last("b.y")), (Some(0), 0.0508, 0.002), "{}", r.said);
}

#[test]
fn a_description_that_names_itself_is_refused_and_connections_that_lead_round_too() {
    let itself = |name: &str| format!("<ssd:Component name=\"{name}\" source=\"SystemStructure.ssd\"/>");
    let r = system(&format!("<ssd:Elements>{}</ssd:Elements>", itself("a")));
    assert!(r.code == Some(2) && r.said.contains("more than 20 systems inside each other"), "{}", r.said);
    let r = system(&format!("<ssd:Elements>{}{}</ssd:Elements>", component("x", ""), itself("a")));
    assert!(r.code == Some(2) && r.said.contains("inside each other"), "{}", r.said);
    let ports = connectors(&[("in", "input", ""), ("out", "output", "")]);
    let sub = format!(
        "<ssd:System name=\"s\">{ports}{}</ssd:System>",
        connections(&connection(("", "in"), ("", "out"), ">"))
    );
    let wires = connection(("s", "out"), ("s", "in"), ">") + &connection(("s", "out"), ("a", "u"), ">");
    let r = system(&format!("<ssd:Elements>{sub}{}</ssd:Elements>{}", component("a", ""), connections(&wires)));
    assert!(r.code == Some(2) && r.said.contains("the connections lead round without a component"), "{}", r.said);
}

#[test]
fn an_archive_inside_an_archive_is_a_system_of_it() {
    let ports = connectors(&[("in", "input", ""), ("out", "output", "")]);
    let wires = connections(&(connection(("", "in"), ("a", "u"), ">") + &connection(("a", "y"), ("", "out"), ">")));
    let inner = ssd("1.0", &format!("{ports}<ssd:Elements>{}</ssd:Elements>{wires}", component("a", "")), "");
    let inner = zipped(&[("SystemStructure.ssd", inner.as_bytes()), ("resources/part.fmu", &part())]);
    let value = bindings(&bound("", &real("u", "3")));
    let given = bindings(&bound("", &real("a.k", "8")));
    let nested = format!("<ssd:Component name=\"box\" source=\"resources/inner.ssp\">{given}</ssd:Component>");
    let elements = component("source", &value) + &nested + &component("sink", "");
    let wires = connection(("source", "y"), ("box", "in"), ">") + &connection(("box", "out"), ("sink", "u"), ">");
    let outer = ssd("1.0", &format!("<ssd:Elements>{elements}</ssd:Elements>{}", connections(&wires)), "");
    let r = ran(&[("SystemStructure.ssd", outer.as_bytes()), ("resources/inner.ssp", &inner)]);
    assert_eq!((r.code, r.last("sink.y"), r.last("box/a.got_k")), (Some(0), 3.0, 8.0), "{}", r.said);
}
