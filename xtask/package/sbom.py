"""Bills of materials of packages, as CycloneDX 1.6 and SPDX 2.3, in JSON.

python xtask/package/sbom.py PACKAGE... writes PACKAGE.cdx.json and PACKAGE.spdx.json beside each package, and the
SHA256SUMS of its folder. The standards' own libraries write and check both. The same package gives the same bytes: the
time is SOURCE_DATE_EPOCH's.
"""

from __future__ import annotations

import hashlib
import os
import re
import sys
import uuid
from datetime import UTC, datetime
from pathlib import Path

import parts
from cyclonedx.model import ExternalReference, ExternalReferenceType, HashAlgorithm, HashType, XsUri
from cyclonedx.model.bom import Bom, BomMetaData
from cyclonedx.model.component import Component, ComponentType
from cyclonedx.model.contact import OrganizationalEntity
from cyclonedx.model.license import LicenseExpression
from cyclonedx.output.json import JsonV1Dot6
from cyclonedx.schema import SchemaVersion
from cyclonedx.validation.json import JsonStrictValidator
from packageurl import PackageURL
from parts import Part
from spdx_tools.common.spdx_licensing import spdx_licensing
from spdx_tools.spdx.model import (
    Actor,
    ActorType,
    Checksum,
    ChecksumAlgorithm,
    CreationInfo,
    Document,
    ExternalPackageRef,
    ExternalPackageRefCategory,
    ExtractedLicensingInfo,
    Package,
    PackagePurpose,
    Relationship,
    RelationshipType,
    SpdxNoAssertion,
)
from spdx_tools.spdx.validation.document_validator import validate_full_spdx_document
from spdx_tools.spdx.writer.json.json_writer import write_document_to_file

SUPPLIER = "The libupt developers"
FREESURFER = "https://surfer.nmr.mgh.harvard.edu/fswiki/FreeSurferSoftwareLicense"


def component(part: Part) -> Component:
    """A part in CycloneDX's words."""
    source = [ExternalReference(type=ExternalReferenceType.DISTRIBUTION, url=XsUri(part.source))] if part.source else []
    return Component(
        bom_ref=part.key or "package",
        name=part.name,
        version=part.version,
        type=ComponentType(part.kind),
        licenses=[LicenseExpression(part.licence)],
        hashes=[HashType(alg=HashAlgorithm.SHA_256, content=part.sha256)] if part.sha256 else [],
        purl=PackageURL.from_string(part.purl) if part.purl else None,
        external_references=source,
        supplier=None if part.purl else OrganizationalEntity(name=SUPPLIER),
    )


def serial(whole: Part) -> uuid.UUID:
    """One for these bytes."""
    return uuid.uuid5(uuid.NAMESPACE_URL, f"{whole.name} {whole.sha256}")


def cyclonedx(whole: Part, inside: list[Part], made: datetime) -> str:
    """The bill, checked against the schema of the standard."""
    components = {part.key: component(part) for part in (whole, *inside)}
    metadata = BomMetaData(component=components[""], timestamp=made, supplier=OrganizationalEntity(name=SUPPLIER))
    bom = Bom(
        metadata=metadata,
        components=[components[part.key] for part in inside],
        serial_number=serial(whole),
    )
    for part in (whole, *inside):
        bom.register_dependency(components[part.key], [components[need] for need in part.needs])
    text = JsonV1Dot6(bom).output_as_string(indent=1)
    fault = JsonStrictValidator(SchemaVersion.V1_6).validate_str(text)
    if fault:
        raise SystemExit(f"{whole.name}: not CycloneDX: {fault}")
    return text + "\n"


def spdx_id(part: Part) -> str:
    """A name that the standard allows."""
    return "SPDXRef-" + (re.sub(r"[^A-Za-z0-9.]+", "-", part.key) or "package")


def package(part: Part) -> Package:
    """A part in SPDX's words."""
    licence = spdx_licensing.parse(part.licence)
    purl = ExternalPackageRef(ExternalPackageRefCategory.PACKAGE_MANAGER, "purl", part.purl)
    purposes = {"data": PackagePurpose.OTHER, "application": PackagePurpose.APPLICATION}
    return Package(
        spdx_id(part),
        part.name,
        part.source or SpdxNoAssertion(),
        version=part.version,
        supplier=SpdxNoAssertion() if part.purl else Actor(ActorType.ORGANIZATION, SUPPLIER),
        files_analyzed=False,
        checksums=[Checksum(ChecksumAlgorithm.SHA256, part.sha256)] if part.sha256 else [],
        license_concluded=licence,
        license_declared=licence,
        copyright_text=SpdxNoAssertion(),
        external_references=[purl] if part.purl else [],
        primary_package_purpose=purposes.get(part.kind, PackagePurpose.LIBRARY),
    )


def spdx(whole: Part, inside: list[Part], made: datetime, file: Path) -> None:
    """Writes the bill, checked by the standard's own rules."""
    by_key = {part.key: part for part in (whole, *inside)}
    creators = [Actor(ActorType.ORGANIZATION, SUPPLIER), Actor(ActorType.TOOL, "cargo-xtask-sbom")]
    relations = [Relationship("SPDXRef-DOCUMENT", RelationshipType.DESCRIBES, spdx_id(whole))]
    for part in (whole, *inside):
        kind = RelationshipType.CONTAINS if part is whole else RelationshipType.DEPENDS_ON
        relations += [Relationship(spdx_id(part), kind, spdx_id(by_key[need])) for need in part.needs]
    text = (
        f"FreeSurfer Software License Agreement, at {FREESURFER}. The surfaces of fsaverage5 are copyright "
        "The General Hospital Corporation; NOTICE says what was made of them."
    )
    document = Document(
        CreationInfo("SPDX-2.3", "SPDXRef-DOCUMENT", whole.name, f"urn:uuid:{serial(whole)}", creators, made),
        [package(part) for part in (whole, *inside)],
        relationships=relations,
    )
    if parts.FREESURFER in whole.licence:
        terms = ExtractedLicensingInfo(parts.FREESURFER, text, "FreeSurfer Software License Agreement", [FREESURFER])
        document.extracted_licensing_info = [terms]
    faults = validate_full_spdx_document(document)
    if faults:
        raise SystemExit(f"{whole.name}: not SPDX: {faults[0].validation_message}")
    write_document_to_file(document, str(file), validate=False)


def main() -> None:
    """Writes the bills and the checksums of a folder's packages."""
    made = datetime.fromtimestamp(int(os.environ.get("SOURCE_DATE_EPOCH", "0")), UTC)
    packages = [Path(name).resolve() for name in sys.argv[1:]]
    for file in packages:
        whole, inside = parts.of(file)
        file.with_name(file.name + ".cdx.json").write_text(
            cyclonedx(whole, inside, made), encoding="utf-8", newline="\n"
        )
        spdx(whole, inside, made, file.with_name(file.name + ".spdx.json"))
        print(f"{file.name}: {len(inside)} parts")
    for folder in sorted({file.parent for file in packages}):
        listed = sorted(one for one in folder.iterdir() if one.is_file() and one.name != "SHA256SUMS")
        lines = [f"{hashlib.sha256(one.read_bytes()).hexdigest()}  {one.name}\n" for one in listed]
        (folder / "SHA256SUMS").write_text("".join(lines), encoding="utf-8", newline="\n")


if __name__ == "__main__":
    main()
