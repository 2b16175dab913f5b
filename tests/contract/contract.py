"""The OpenAPI file, and whether an answer keeps to it."""
import json
import urllib.parse

import jsonschema

from service import with_query

METHODS = ("get", "put", "post", "delete", "patch")


class Operation:
    def __init__(self, contract, method, path, item):
        self.contract = contract
        self.method = method.upper()
        self.path = path
        self.node = item[method]
        self.id = self.node["operationId"]
        self.parameters = [contract.resolve(p) for p in item.get("parameters", []) + self.node.get("parameters", [])]
        self.responses = {status: contract.resolve(r) for status, r in self.node["responses"].items()}

    def query_parameters(self):
        return [p for p in self.parameters if p["in"] == "query"]

    def body_schema(self):
        """Of a JSON body; none where there is no body, or one of another kind."""
        media = self.node.get("requestBody", {}).get("content", {}).get("application/json")
        return media and media["schema"]

    def body_type(self):
        """One that it takes."""
        return next(iter(self.node.get("requestBody", {}).get("content", {"application/json": {}})))

    def target(self, path_parameters, query=None):
        """Parameters that are not given are as in their examples."""
        path = self.path
        examples = {p["name"]: str(p["example"]) for p in self.parameters if p["in"] == "path" and "example" in p}
        for name, value in {**examples, **path_parameters}.items():
            path = path.replace("{" + name + "}", urllib.parse.quote(value, safe=""))
        assert "{" not in path, f"{self.id}: {path} has an open parameter"
        return with_query(path, query)

    def __str__(self):
        return f"{self.id} ({self.method} {self.path})"


class Contract:
    def __init__(self, file):
        with open(file, encoding="utf-8") as text:
            self.document = json.load(text)
        self._resolver = jsonschema.RefResolver("", self.document)
        self.operations = {}
        for path, item in self.document["paths"].items():
            for method in METHODS:
                if method in item:
                    operation = Operation(self, method, path, item)
                    assert operation.id not in self.operations, f"{operation.id} is there twice"
                    self.operations[operation.id] = operation

    def resolve(self, node):
        """The node, or what its $ref names, with what stands beside the $ref."""
        while "$ref" in node:
            beside = {key: value for key, value in node.items() if key != "$ref"}
            node = {**self.at(node["$ref"]), **beside}
        return node

    def at(self, pointer):
        assert pointer.startswith("#/"), f"{pointer}: only references within the file"
        node = self.document
        for step in pointer[2:].split("/"):
            step = step.replace("~1", "/").replace("~0", "~")
            assert isinstance(node, dict) and step in node, f"{pointer} leads nowhere (at {step})"
            node = node[step]
        return node

    def check_value(self, schema, value, where):
        validator = jsonschema.Draft202012Validator(schema, resolver=self._resolver)
        wrong = sorted(validator.iter_errors(value), key=lambda error: list(error.absolute_path))
        lines = [f"  {'.'.join(map(str, e.absolute_path)) or '(whole)'}: {e.message}" for e in wrong[:8]]
        assert not wrong, f"{where}: the body is not as the contract says:\n" + "\n".join(lines)

    def check_answer(self, answer, declared, where):
        """`declared`: the response object of this status."""
        for name, header in declared.get("headers", {}).items():
            given = answer.headers.get(name.lower())
            assert given is not None or not header.get("required"), f"{where}: no header {name}: {answer}"
        if answer.status >= 400:
            assert answer.content_type == "application/problem+json", f"{where}: an error without a problem: {answer}"
        content = declared.get("content")
        if not content:
            assert answer.body == b"", f"{where}: a body where the contract has none: {answer}"
            return
        assert answer.body, f"{where}: an empty body: {answer}"
        assert answer.content_type in content, f"{where}: {answer.content_type!r} is not declared: {answer}"
        if answer.content_type.endswith("json"):
            value = answer.json()
            self.check_value(content[answer.content_type]["schema"], value, where)
            if answer.status >= 400:
                assert value["status"] == answer.status, f"{where}: the problem says another status: {answer}"

    def check(self, operation, answer, what=""):
        where = f"{operation}{' ' + what if what else ''}"
        declared = operation.responses.get(str(answer.status))
        assert declared is not None, f"{where}: status {answer.status} is not in the contract: {answer}"
        self.check_answer(answer, declared, where)

    def references(self):
        return set(self._references(self.document))

    def _references(self, node):
        if isinstance(node, dict):
            if isinstance(node.get("$ref"), str):
                yield node["$ref"]
            for value in node.values():
                yield from self._references(value)
        elif isinstance(node, list):
            for value in node:
                yield from self._references(value)
