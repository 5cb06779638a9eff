from licences import faults, is_allowed

ALLOWED = {"MIT", "Apache-2.0", "Apache-2.0 WITH LLVM-exception"}
REGISTRY = "https://example.org/index"
DENY = {"licenses": {"allow": sorted(ALLOWED)}, "sources": {"allow-registry": [REGISTRY]}}


def test_an_expression_is_allowed_where_its_licences_can_be_chosen_so():
    for expression in ("MIT", "MIT OR GPL-3.0", "GPL-2.0/MIT", "(GPL-3.0 OR MIT) AND Apache-2.0",
                       "Apache-2.0 WITH LLVM-exception"):
        assert is_allowed(expression, ALLOWED), expression
    for expression in ("GPL-3.0", "MIT AND GPL-3.0", "GPL-2.0 WITH Classpath-exception-2.0",
                       "(MIT OR GPL-3.0) AND GPL-3.0"):
        assert not is_allowed(expression, ALLOWED), expression


def test_a_crate_of_another_source_or_without_a_licence_is_reported():
    crate = {"name": "a", "version": "1", "license": "MIT", "source": f"registry+{REGISTRY}"}
    assert faults([crate, crate | {"source": None}], DENY) == []
    assert "licence None" in faults([crate | {"license": None}], DENY)[0]
    assert "source git+x" in faults([crate | {"source": "git+x"}], DENY)[0]
