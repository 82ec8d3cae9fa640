"""inspect.html: meshes, groups and contact pairs as read, before anything is computed with them."""

from dataclasses import dataclass, field

import numpy as np

from tipdamp.bodies.surfaces import contact_edges
from tipdamp.fields import surface
from tipdamp.hbm.contact import ContactTable
from tipdamp.modal.mesh import Mesh
from tipdamp.report.page import Block, Section, page
from tipdamp.report.subjects.bodies import bodies_table, mesh_groups
from tipdamp.report.subjects.pairs import contact_pairs, pairs_table
from tipdamp.report.text import sentence
from tipdamp.results.static_results import InspectResult
from tipdamp.study.view import Study


@dataclass(frozen=True)
class Inspected:
    """What was read: no meshes where matrices were given; no pairs where they could not be matched,
    `trouble` says why.

    places {body: (P, 3) m} of the two nodes of each pair; angles (P,) degrees between normals and
    surfaces
    """

    meshes: dict[str, Mesh] = field(default_factory=dict)
    pairs: ContactTable | None = None
    places: dict[str, np.ndarray] | None = None
    angles: np.ndarray | None = None
    trouble: str = ""


def inspection_page(study: Study, found: InspectResult, read: Inspected) -> str:
    """The page of what `inspect` found; without pairs it shows the contact nodes without a
    partner."""
    surfaces = {name: surface.skin(mesh, name) for name, mesh in read.meshes.items()}
    sections: list[Section[Block]] = []
    if read.pairs is not None and read.places is not None:
        edges = contact_edges(study, read.meshes) if read.meshes else None
        picture = contact_pairs(
            read.pairs, read.places, surfaces, study.driver.axis, read.angles, edges
        )
        sections.append(Section("pairs", "Contact pairs", [pairs_table(found), picture]))
    if read.meshes:
        groups = mesh_groups(study, read.meshes, surfaces, unmatched=read.pairs is None)
        sections.append(Section("meshes", "Meshes and groups", [bodies_table(found), groups]))
    return page(
        "inspection.html",
        study.title,
        study.path.name,
        sections,
        trouble=sentence(read.trouble) if read.trouble else "",
        warnings=[sentence(w) for w in found.warnings],
    )
