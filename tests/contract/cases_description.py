"""The file itself, and whether it speaks of the same paths as the program."""
import json
import re

import jsonschema

from fixture import ROOT, Case, run_program

# Served from memory by the front, no routes: the page.
PAGE = ("/", "/page.js", "/simulator.js", "/page.css", "/icon.svg")
FILES = ("/openapi.json",)  # the same, but described
# What the contract leaves to the configuration file, and what differs in wording only.
WORDS = ("description", "title", "examples", "maxLength", "default")


class Description(Case):
    def test_every_reference_leads_somewhere_and_every_part_is_referred_to(self):
        used = self.contract.references()
        for reference in used:
            self.contract.at(reference)
        for kind, parts in self.contract.document["components"].items():
            for name in parts:
                self.assertIn(f"#/components/{kind}/{name}", used, "nothing refers to it")

    def test_every_schema_is_valid_json_schema_2020_12(self):
        for name, schema in self.contract.document["components"]["schemas"].items():
            try:
                jsonschema.Draft202012Validator.check_schema(schema)
            except jsonschema.SchemaError as error:
                self.fail(f"{name}: {error.message}")

    def test_every_object_of_an_answer_is_closed(self):
        def walk(node, where):
            if isinstance(node, dict):
                if "properties" in node and node.get("type") == "object":
                    self.assertIs(node.get("additionalProperties"), False, where)
                for key, value in node.items():
                    walk(value, f"{where}.{key}")
        walk(self.contract.document["components"]["schemas"], "schemas")

    def test_path_parameters_and_only_those_are_declared(self):
        for operation in self.contract.operations.values():
            named = set(re.findall(r"\{(\w+)\}", operation.path))
            declared = {p["name"] for p in operation.parameters if p["in"] == "path"}
            self.assertEqual(named, declared, str(operation))
            for parameter in operation.parameters:
                self.assertEqual(parameter.get("required", False), parameter["in"] == "path", str(operation))
                self.assertTrue(parameter.get("description"), f"{operation}: {parameter['name']} is not described")

    def test_every_operation_has_words_a_tag_a_success_and_errors_as_problems(self):
        tags = {tag["name"] for tag in self.contract.document["tags"]}
        for operation in self.contract.operations.values():
            self.assertTrue(operation.node.get("summary"), str(operation))
            self.assertLessEqual(set(operation.node["tags"]), tags, str(operation))
            self.assertTrue(any(status.startswith("2") for status in operation.responses), str(operation))
            for status, response in operation.responses.items():
                self.assertTrue(response.get("description"), f"{operation} {status}")
                if int(status) >= 400:
                    self.assertEqual(list(response["content"]), ["application/problem+json"], f"{operation} {status}")

    def test_every_example_keeps_to_its_schema(self):
        count = 0
        for operation in self.contract.operations.values():
            contents = [r.get("content", {}) for r in operation.responses.values()]
            contents.append(operation.node.get("requestBody", {}).get("content", {}))
            for media in (media for content in contents for media in content.values()):
                examples = [e["value"] for e in media.get("examples", {}).values()]
                for example in examples + ([media["example"]] if "example" in media else []):
                    self.contract.check_value(media["schema"], example, f"{operation}: an example")
                    count += 1
        self.assertGreater(count, 15)

    def test_the_version_is_the_programs(self):
        self.assertEqual(run_program("--version").split()[-1], self.contract.document["info"]["version"])

    def test_the_service_hands_out_this_file(self):
        answer = self.call("getDescription", 200)
        self.assertEqual(answer.json(), json.loads((ROOT / "service" / "openapi.json").read_text(encoding="utf-8")))
        self.call("getDescription", 304, headers={"If-None-Match": answer.headers["etag"]})

    def test_program_and_file_have_the_same_paths(self):
        lines = run_program("serve", "--print-routes").splitlines()
        routes = {tuple(line.split()) for line in lines if line.strip()}
        routes = {(method, path) for method, path in routes if path not in PAGE}
        described = {(o.method, o.path) for o in self.contract.operations.values()}
        self.assertEqual(routes - described, set(), "routes that openapi.json does not describe")
        missing = {(method, path) for method, path in described - routes if path not in FILES}
        self.assertEqual(missing, set(), "openapi.json describes what the program lacks")

    def test_every_described_path_is_answered_by_more_than_the_router(self):
        for operation in self.contract.operations.values():
            target = operation.target({"id": "nothing-of-that-name"} if "{id}" in operation.path else {})
            answer = self.service.request("OPTIONS", target)
            self.assertEqual(answer.status, 204, f"{operation}: {answer}")
            self.assertIn(operation.method, answer.headers["allow"].split(", "), str(operation))

    def test_settings_allow_what_the_configuration_allows(self):
        config = json.loads((ROOT / "deploy" / "skylight.schema.json").read_text(encoding="utf-8"))
        ours = self.contract.document["components"]["schemas"]
        self.assertEqual(self.plain(ours["RobotSettings"], self.contract.document),
                         self.plain(config["$defs"]["RobotConfig"], config))
        wanted = self.plain(config["$defs"]["AppearanceConfig"], config)
        for key in ("image", "metres_per_pixel"):  # files are the configuration's alone
            del wanted["properties"][key]
        del wanted["allOf"]
        wanted["required"] = ["cut_from_frame", "id"]
        self.assertEqual(self.plain(ours["AppearanceSettings"], self.contract.document), wanted)

    def plain(self, schema, document):
        """What a schema allows, without its words and references."""
        if isinstance(schema, list):
            return [self.plain(part, document) for part in schema]
        if not isinstance(schema, dict):
            return schema
        if "$ref" in schema:
            node = document
            for step in schema["$ref"][2:].split("/"):
                node = node[step]
            schema = {**node, **{key: value for key, value in schema.items() if key != "$ref"}}
        out = {}
        for key, value in schema.items():
            if key == "properties":
                out[key] = {name: self.plain(part, document) for name, part in value.items()}
            elif key == "required":
                out[key] = sorted(value)
            elif key not in WORDS:
                out[key] = self.plain(value, document)
        if "oneOf" in out:
            out.pop("type", None)
        return out

    def test_the_page_is_served_under_a_policy_without_inline_code(self):
        page = self.service.request("GET", "/")
        self.assertEqual((page.status, page.content_type), (200, "text/html"))
        policy = page.headers["content-security-policy"]
        self.assertIn("default-src 'self'", policy)
        self.assertNotIn("unsafe", policy)
        text = page.body.decode()
        for file in re.findall(r"""(?:src|href)="(/[^"]*)\"""", text):
            answer = self.service.request("GET", file)
            self.assertEqual(answer.status, 200, f"the page names {file}: {answer}")
