//! Translates the document's texts. They are collected once, before the program writes any text, and each one's English
//! original is kept with its location.

use crate::language::say;
use crate::page::dom;
use wasm_bindgen::JsCast;
use web_sys::{Element, HtmlTemplateElement, Node};

/// Attributes that are shown or read out; the style sheet shows the last two.
const ATTRIBUTES: [&str; 6] =
    ["aria-label", "title", "placeholder", "alt", "data-first", "data-last"];

pub struct Translated {
    texts: Vec<(Node, String)>,
    attributes: Vec<(Element, &'static str, String)>,
    /// The language currently shown.
    language: String,
}

impl Translated {
    /// Collects all texts of the document, which are in English.
    pub fn collect() -> Translated {
        let mut found =
            Translated { texts: Vec::new(), attributes: Vec::new(), language: "en".to_owned() };
        found.visit(&dom::root());
        found
    }

    fn visit(&mut self, node: &Node) {
        if let Some(element) = node.dyn_ref::<Element>() {
            for name in ATTRIBUTES {
                if let Some(english) = element.get_attribute(name) {
                    self.attributes.push((element.clone(), name, english));
                }
            }
        }
        if node.node_type() == Node::TEXT_NODE {
            self.texts.push((node.clone(), node.node_value().unwrap_or_default()));
        }
        if let Some(template) = node.dyn_ref::<HtmlTemplateElement>() {
            self.visit(&template.content());
        }
        let mut child = node.first_child();
        while let Some(node) = child {
            self.visit(&node);
            child = node.next_sibling();
        }
    }

    /// Shows the document in the current language; returns whether the language changed.
    pub fn show(&mut self, language: &str) -> bool {
        if self.language == language {
            return false;
        }
        language.clone_into(&mut self.language);
        dom::set(&dom::root(), "lang", Some(language));
        for (node, english) in &self.texts {
            let sentence = english.trim();
            let text = english.replacen(sentence, say(sentence), 1);
            if !sentence.is_empty() && node.node_value().as_ref() != Some(&text) {
                node.set_node_value(Some(&text));
            }
        }
        for (element, name, english) in &self.attributes {
            dom::set(element, name, Some(say(english)));
        }
        true
    }
}
