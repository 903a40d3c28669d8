//! The texts of a scene that players are shown.

use super::spec::Scene;

impl Scene {
    /// Everything that its author wrote for players, each with the path of its field.
    pub fn texts(&self) -> Vec<(String, &str)> {
        let mut texts = vec![("title".to_owned(), self.title.as_str())];
        texts.push(("about".to_owned(), self.about.as_str()));
        let task = self.rules.round.iter().map(|round| round.task.as_str());
        texts.extend(task.map(|task| ("round.task".to_owned(), task)));
        let zones = self.rules.zones.iter().enumerate();
        texts.extend(
            zones.map(|(index, zone)| (format!("zones[{index}].label"), zone.label.as_str())),
        );
        let rules = self.rules.rules.iter().enumerate();
        texts.extend(rules.filter_map(|(index, rule)| {
            let line = rule.effects.say.as_ref()?;
            Some((format!("rules[{index}].say"), line.text.as_str()))
        }));
        texts.retain(|(_, text)| !text.is_empty());
        texts
    }
}
