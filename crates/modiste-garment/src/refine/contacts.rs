//! How a vertex of cloth lies to the surfaces below it.

use modiste_core::Vec3;

use super::contact::Contact;
use super::cover::Ground;
use super::home::Home;
use super::obstacle::NO_HINT;

/// Most surfaces below a garment, the body and the garments under it; those beyond are left out.
pub(crate) const MOST: usize = 4;
/// Between opposite contacts whose normals have a product below this, a vertex has two walls to stay away from.
const OPPOSITE: f64 = -0.3;
/// Vertices nearer to a body than this (m) are looked at twice.
const DOUBTFUL: f64 = 0.001;
/// Longest step of a single vertex between two walls in one final round (m).
const LONGEST_STEP: f64 = 0.015;

/// The contacts of a vertex, one of each surface at most.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Contacts {
    items: [Contact; MOST],
    owners: [u8; MOST],
    count: usize,
}

impl Contacts {
    pub(crate) const EMPTY: Self = Self { items: [Contact::NONE; MOST], owners: [0; MOST], count: 0 };

    pub(crate) fn as_slice(&self) -> &[Contact] {
        &self.items[..self.count]
    }

    fn push(&mut self, owner: usize, contact: Contact) {
        if self.count < MOST {
            self.items[self.count] = contact;
            self.owners[self.count] = owner as u8;
            self.count += 1;
        }
    }

    /// The least distance (m); infinite without contacts.
    pub(crate) fn least(&self) -> f64 {
        self.as_slice().iter().fold(f64::INFINITY, |least, contact| least.min(contact.distance))
    }

    /// The least distance (m) from a surface itself; infinite without contacts. Up to the middle between two limbs it is nobody's.
    pub(crate) fn depth(&self) -> f64 {
        let from_surface =
            |contact: &Contact| contact.distance + if contact.room.is_finite() { contact.raised } else { 0.0 };
        self.as_slice().iter().map(from_surface).fold(f64::INFINITY, f64::min)
    }

    /// The contact with one surface.
    pub(crate) fn of(&self, owner: u8) -> Option<&Contact> {
        self.owners[..self.count]
            .iter()
            .zip(&self.items)
            .find(|(other, _)| **other == owner)
            .map(|(_, contact)| contact)
    }

    /// The nearest contact and the surface it is with.
    pub(crate) fn nearest(&self) -> Option<(usize, &Contact)> {
        let owned = self.owners.iter().map(|&owner| usize::from(owner)).zip(self.as_slice());
        owned.min_by(|(_, a), (_, b)| a.distance.total_cmp(&b.distance))
    }
}

/// A vertex of cloth among the surfaces below.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Site {
    pub(crate) contacts: Contacts,
    /// Nearest faces, which in the next frame most often are the same.
    hints: [u32; MOST],
    /// The same of the skin that the vertex is worn on, as far as that was looked for.
    home_hint: u32,
    /// How far the vertex may move before its contacts must be found again (m).
    pub(crate) slack: f64,
    /// The place outside (m) that it goes to where parts pass through each other around it.
    pub(crate) exit: Option<Vec3>,
    /// Whether it may have moved so far since its contacts were found that they must be found again.
    pub(crate) stale: bool,
    /// Whether its contacts with garments must be found, but the one with the body is known.
    pub(crate) bare: bool,
    /// Whether it has moved at all since its contacts were found.
    pub(crate) moved: bool,
    /// Whether its contacts were found since it was last asked what shows through the cloth there.
    pub(crate) fresh: bool,
    /// Whether nothing more can be done for it where it is.
    settled: bool,
}

impl Site {
    pub(crate) const NEW: Self = Self {
        contacts: Contacts::EMPTY,
        hints: [NO_HINT; MOST],
        home_hint: NO_HINT,
        slack: 0.0,
        exit: None,
        stale: true,
        bare: false,
        moved: false,
        fresh: true,
        settled: false,
    };

    /// Finds the contacts of the vertex where it is now. Garments are looked for within `reach` (m), bodies anywhere.
    ///
    /// Skin of another limb that faces the skin the vertex is worn on, its `home`, counts from the middle between the two: the
    /// other half of the room is for what is worn on that limb.
    pub(crate) fn look(&mut self, grounds: &[Ground<'_>], at: Vec3, reach: f64, home: Option<&Home>) {
        // A contact with the body that is known is the first.
        let first = usize::from(self.bare && !self.stale);
        self.contacts.count = self.contacts.count.min(first);
        for (index, (ground, hint)) in grounds.iter().zip(&mut self.hints).enumerate().skip(first) {
            if index > 0 && !may_touch_garments(&self.contacts, grounds) {
                continue;
            }
            let reach = if ground.obstacle.crosses_itself() { f64::INFINITY } else { reach };
            if let Some(mut contact) = ground.touch(at, reach, hint) {
                if index == 0
                    && let Some(home) = home
                {
                    ground.leave_half(at, &mut contact, home, &mut self.home_hint);
                }
                self.contacts.push(index, contact);
            }
        }
        self.slack = self.contacts.least().min(reach);
        (self.stale, self.bare, self.moved) = (false, false, false);
        (self.fresh, self.settled) = (true, false);
    }

    /// Raises the body in the contact that was found with it alone, and the way out as far as there is room.
    pub(crate) fn raise(&mut self, body: &Ground<'_>) {
        if let Some(exit) = &mut self.exit {
            let raised = *exit + body.height_of(self.hints[0]) * body.obstacle.face_normal(self.hints[0]);
            *exit = if body.obstacle.is_inside(raised) { *exit } else { raised };
        }
        if let Some(contact) = self.contacts.items[..self.contacts.count].first_mut() {
            // The middle between two limbs is moved by what lies on one.
            self.stale |= contact.room.is_finite();
            body.raise(contact);
            self.slack = self.slack.min(contact.distance);
        }
    }

    /// Whether garments below may be near, by the contact with the body: they lie only where they raise it.
    pub(crate) fn may_touch_garments(&self, grounds: &[Ground<'_>]) -> bool {
        may_touch_garments(&self.contacts, grounds)
    }

    /// Looks for the way out of the parts that pass through each other around the vertex, if they do, or of a limb that it
    /// would otherwise leave on the wrong side. `home` is where the cloth is worn.
    ///
    /// It lies at their rim, as near as there is room, and is not looked for again in this frame.
    pub(crate) fn find_exit(&mut self, grounds: &[Ground<'_>], at: Vec3, clearance: f64, home: Option<&Home>) {
        let body = grounds[0].obstacle;
        let (hint, own) = (&mut self.hints[0], &mut self.home_hint);
        let contacts = &self.contacts;
        let is_lost = contacts.as_slice().iter().any(|contact| contact.pinched)
            || contacts.of(0).is_some_and(|contact| body.leads_astray(at, contact, home, own));
        self.exit = is_lost.then(|| body.way_home(at, clearance, [hint, own], home));
    }

    /// Whether the vertex may be inside the body though its contacts say otherwise.
    pub(crate) fn is_doubtful(&self) -> bool {
        self.contacts.of(0).is_none_or(|body| !body.certain || body.distance + body.raised < DOUBTFUL)
    }

    /// Moves a vertex that is nearer than `least` (m) by itself, out of all surfaces and of the body in any case.
    pub(crate) fn settle(
        &mut self,
        grounds: &[Ground<'_>],
        at: &mut Vec3,
        (least, reach): (f64, f64),
        rounds: usize,
        home: Option<&Home>,
    ) {
        if let Some(exit) = self.exit {
            *at = exit;
            (self.stale, self.settled) = (false, true);
            return;
        }
        if self.stale || self.bare {
            self.look(grounds, *at, reach, home);
        }
        if self.settled {
            return;
        }
        for _ in 0..rounds {
            if self.contacts.least() >= least {
                break;
            }
            *at += least_step(self.contacts.as_slice(), 2.0 * least);
            self.stale = true;
            self.look(grounds, *at, reach, home);
        }
        let mut moved = false;
        for index in 0..self.contacts.count {
            let (owner, contact) = (usize::from(self.contacts.owners[index]), self.contacts.items[index]);
            let obstacle = grounds[owner].obstacle;
            if obstacle.holds(*at, &contact) {
                *at = obstacle.way_out(*at, 2.0 * least, &mut self.hints[owner]);
                moved = true;
            }
        }
        if moved {
            self.stale = true;
            self.look(grounds, *at, reach, home);
        }
        self.settled = true;
    }
}

fn may_touch_garments(contacts: &Contacts, grounds: &[Ground<'_>]) -> bool {
    let is_near = |body: &Contact| body.raised > 0.0;
    grounds[0].cover.is_none() || contacts.of(0).is_none_or(is_near)
}

/// The distance that a vertex is to keep from a contact (m): less than the clearance between two walls that are close.
pub(crate) fn wanted_distance(contact: &Contact, contacts: &[Contact], clearance: f64) -> f64 {
    let facing = contacts.iter().filter(|other| other.normal.dot(contact.normal) < OPPOSITE);
    let most = clearance.min(0.5 * contact.room);
    let room = facing.map(|other| 0.5 * (contact.distance + other.distance)).fold(most, f64::min);
    room.max(0.0)
}

/// The shortest step (m) to `wanted` distance from the nearest two contacts.
fn least_step(contacts: &[Contact], wanted: f64) -> Vec3 {
    let gap = |contact: &Contact| wanted_distance(contact, contacts, wanted).max(1e-5) - contact.distance;
    let mut sorted = [None; 2];
    for contact in contacts {
        if sorted[0].is_none_or(|first: &Contact| gap(contact) > gap(first)) {
            sorted = [Some(contact), sorted[0]];
        } else if sorted[1].is_none_or(|second: &Contact| gap(contact) > gap(second)) {
            sorted[1] = Some(contact);
        }
    }
    let Some(first) = sorted[0].filter(|first| gap(first) > 0.0) else { return Vec3::ZERO };
    let single = gap(first) * first.normal;
    match sorted[1] {
        // The single step would get too near to the second contact, so both are met at once.
        Some(second) if single.dot(second.normal) < gap(second) => {
            let cosine = first.normal.dot(second.normal);
            let determinant = (1.0 - cosine * cosine).max(0.02);
            let along_first = (gap(first) - cosine * gap(second)) / determinant;
            let along_second = (gap(second) - cosine * gap(first)) / determinant;
            (along_first * first.normal + along_second * second.normal).clamp_length_max(LONGEST_STEP)
        }
        _ => single,
    }
}
