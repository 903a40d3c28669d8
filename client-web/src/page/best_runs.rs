//! The best runs that the server keeps, as the page knows them.

use jostle_protocol::web::{self, RecordCard, RecordTable};

/// Records, as far as the page knows them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Records {
    /// The best run of each scene.
    pub list: web::Records,
    /// The sentence about the own run.
    pub said: String,
    /// The beginning of the result whose run was looked at.
    pub result_since: Option<u32>,
}

impl Records {
    /// Forgets the own run.
    pub fn begin(&mut self) {
        *self = Records { list: std::mem::take(&mut self.list), ..Records::default() };
    }

    /// The table of a scene, if its runs are kept.
    pub fn table(&self, scene: &str) -> Option<&RecordTable> {
        self.list.scenes.iter().find(|table| table.scene == scene)
    }

    /// The best run of a scene, with its table.
    pub fn best(&self, scene: &str) -> Option<(&RecordTable, &RecordCard)> {
        let table = self.table(scene)?;
        Some((table, table.records.first()?))
    }
}
