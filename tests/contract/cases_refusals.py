"""Bad input to every operation: one clear problem each time, and the service goes on."""
import re

from fixture import Case

NOTHING = "nothing-of-that-name"
KNOWN = {"/api/v1/robots/{id}": "anna", "/api/v1/cameras/{id}": "ceiling"}
MAX_BODY_BYTES = 1024 * 1024


def bad_values(schema):
    """Texts that a query parameter of this schema must not have."""
    if "enum" in schema:
        return ["", "nonsense", schema["enum"][0].upper(), schema["enum"][0] + " "]
    if schema.get("type") == "string":
        return [text for text in ("", "a b", " a", "x" * 65, "\u00e9") if not re.search(schema["pattern"], text)]
    bad = ["", "abc", "nan", "-inf", "1e999", "1,5", "5 ", " 5", "0x100"]
    bad += [repr(schema["minimum"] - 1), repr(schema["maximum"] + 1)] + (["0"] if schema["minimum"] > 0 else [])
    return bad + (["1.5"] if schema["type"] == "integer" else [])


def good_values(schema):
    if schema.get("type") == "string":
        return ["x", "x" * 64]
    return schema.get("enum") or [schema["minimum"], schema["maximum"]]


class Refusals(Case):
    def operations(self):
        """Those that routes answer, each with path parameters that exist."""
        for operation in self.contract.operations.values():
            if operation.path == "/openapi.json":
                continue
            known = [name for prefix, name in KNOWN.items() if operation.path.startswith(prefix)]
            path = {"id": known[0]} if known else {}
            # Nothing may really be removed or added by a request that is meant to be refused.
            yield operation, path, ({} if operation.body_schema() else None)

    def test_unknown_query_parameters_are_refused(self):
        for operation, path, body in self.operations():
            with self.subTest(operation=operation.id):
                self.problem(operation.id, 400, "atx", path=path, query={"atx": 1}, body=body)

    def test_query_parameters_out_of_range_are_refused_with_name_and_value(self):
        for operation, path, _ in self.operations():
            for parameter in operation.query_parameters():
                for bad in bad_values(self.contract.resolve(parameter["schema"])):
                    with self.subTest(operation=operation.id, parameter=parameter["name"], value=bad):
                        self.problem(operation.id, 400, parameter["name"], bad, "allowed", path=path,
                                     query={parameter["name"]: bad})

    def test_query_parameters_given_twice_are_refused(self):
        for operation, path, _ in self.operations():
            for parameter in operation.query_parameters():
                with self.subTest(operation=operation.id, parameter=parameter["name"]):
                    good = self.contract.resolve(parameter["schema"]).get("enum", [100, 101])[:2]
                    self.problem(operation.id, 400, parameter["name"], path=path, query={parameter["name"]: good})

    def test_the_ends_of_each_range_are_taken(self):
        for operation, path, _ in self.operations():
            for parameter in operation.query_parameters():
                schema = self.contract.resolve(parameter["schema"])
                for good in good_values(schema):
                    with self.subTest(operation=operation.id, parameter=parameter["name"], value=good):
                        target = operation.target(path, {parameter["name"]: good})
                        answer = self.service.request(operation.method, target)
                        self.contract.check(operation, answer, target)
                        self.assertIn(answer.status, (200, 409, 422), f"{operation}: {answer}")

    def test_ids_that_nothing_has_are_not_found(self):
        for operation, path, body in self.operations():
            for unknown in [NOTHING, "%", "\u00e9\u4e16", "'; DROP", "x" * 300] if path else []:
                with self.subTest(operation=operation.id, id=unknown):
                    self.problem(operation.id, 404, unknown, path={"id": unknown}, body=body)

    def test_paths_that_lead_nowhere_are_not_found(self):
        declared = self.contract.resolve(self.contract.document["x-any-path"]["404"])
        for path in ("/api", "/api/v1", "/api/v2/robots", "/api/v1/robots/", "/api/v1/robots/anna/pose/", "//", "/web"):
            answer = self.service.request("GET", path)
            self.assertEqual(answer.status, 404, f"{path}: {answer}")
            self.contract.check_answer(answer, declared, path)

    def test_other_methods_are_refused_naming_those_that_are_taken(self):
        declared = self.contract.resolve(self.contract.document["x-any-path"]["405"])
        taken = {}
        for operation in self.contract.operations.values():
            taken.setdefault(operation.path, set()).add(operation.method)
        for path, methods in taken.items():
            for method in {"GET", "PUT", "POST", "PATCH", "DELETE", "PROPFIND"} - methods:
                answer = self.service.request(method, path.replace("{id}", "anna").replace("{number}", "1"))
                self.assertEqual(answer.status, 405, f"{method} {path}: {answer}")
                self.contract.check_answer(answer, declared, f"{method} {path}")
                self.assertLessEqual(methods, set(answer.headers["allow"].split(", ")), f"{method} {path}")

    def test_head_answers_as_get_without_a_body(self):
        for operation, path, _ in self.operations():
            if operation.method == "GET":
                got = self.service.request("GET", operation.target(path))
                answer = self.service.request("HEAD", operation.target(path))
                self.assertEqual((answer.status, answer.body), (got.status, b""), str(operation))
                self.assertEqual(answer.headers["content-type"], got.headers["content-type"], str(operation))

    def test_bodies_that_are_no_json_are_refused_naming_the_place(self):
        for operation, path, body in self.operations():
            if body is None:
                continue
            for text in (b"", b"{", b"{\"id\": }", b"[1, 2", b"{\"id\": \"a\", \"id\": \"b\"}", b"\xff\xfe", b"NaN",
                         b"{\"surface_height_m\": NaN}", b"{\"surface_height_m\": 1e999}", b"[" * 5000):
                with self.subTest(operation=operation.id, body=text[:40]):
                    self.problem(operation.id, 400, "body", path=path, body=text)

    def test_bodies_of_another_shape_are_refused(self):
        for operation, path, body in self.operations():
            if body is None:
                continue
            for value in ([], "text", 7, {"id": 7}, {"id": ""}, {"id": "a b"}, {"id": "x" * 65}, {"idd": "x"}):
                with self.subTest(operation=operation.id, body=value):
                    self.problem(operation.id, 422, "body", path=path, body=value)
            with self.subTest(operation=operation.id, body=None):
                self.problem(operation.id, 422, "body", path=path, body=b"null")

    def test_only_json_is_taken(self):
        for operation, path, body in self.operations():
            if operation.method == "GET":
                continue
            sent = b"{}" if body is not None else b"x"
            for kind in ("text/plain", "application/x-www-form-urlencoded", "multipart/form-data", "application/xml"):
                with self.subTest(operation=operation.id, content_type=kind):
                    self.problem(operation.id, 415, kind, path=path, body=sent, headers={"Content-Type": kind})

    def test_bodies_that_are_too_long_are_refused_before_they_are_sent(self):
        for operation, path, body in self.operations():
            if operation.method == "GET":
                continue
            head = (f"{operation.method} {operation.target(path)} HTTP/1.1\r\nHost: localhost\r\n"
                    f"Content-Type: {operation.body_type()}\r\n")
            length = f"Content-Length: {MAX_BODY_BYTES + 1}\r\n\r\n".encode()
            chunk = b"Transfer-Encoding: chunked\r\n\r\n" + b"10000\r\n" + b" " * 0x10000 + b"\r\n"
            chunk += (b"10000\r\n" + b" " * 0x10000 + b"\r\n") * 16
            for framing in (length, chunk):
                with self.subTest(operation=operation.id, framing=framing[:30]):
                    answer = self.service.send_raw(head.encode() + framing)
                    self.assertEqual(answer.status, 413, f"{operation}: {answer}")
                    self.contract.check(operation, answer)
                    self.assertIn(str(MAX_BODY_BYTES), answer.json()["detail"], str(operation))

    def test_pages_of_other_sites_may_not_write(self):
        for operation, path, body in self.operations():
            if operation.method != "GET":
                with self.subTest(operation=operation.id):
                    self.problem(operation.id, 403, "evil.example", path=path, body=body,
                                 headers={"Origin": "http://evil.example"})

    def test_other_names_of_the_host_and_odd_headers_are_refused(self):
        for operation, path, body in self.operations():
            with self.subTest(operation=operation.id):
                self.problem(operation.id, 421, "evil.example", path=path, body=body, headers={"Host": "evil.example"})
                self.problem(operation.id, 417, "100-continue", path=path, body=body, headers={"Expect": "a miracle"})
                self.problem(operation.id, 431, "bytes", path=path, body=body, headers={"X-Long": "x" * 20000})
                self.problem(operation.id, 414, "bytes", path=path, query={"at": "1" * 5000}, body=body)
                if operation.method == "GET":
                    self.problem(operation.id, 400, "body", path=path, body=b"{}")

    def test_the_description_is_guarded_like_the_rest(self):
        self.problem("getDescription", 421, headers={"Host": "evil.example"})
        self.problem("getDescription", 431, headers={"X-Long": "x" * 20000})

    def test_what_is_not_http_gets_a_problem_too(self):
        for data in (b"nonsense\r\n\r\n", b"GET / HTTP/9.9\r\n\r\n", b"GET /livez HTTP/1.1\r\n\r\n",
                     b"GET /%zz HTTP/1.1\r\nHost: localhost\r\n\r\n", b"GET /a%2Fb HTTP/1.1\r\nHost: localhost\r\n\r\n",
                     b"GET /livez HTTP/1.1\r\nHost: localhost\r\nHost: localhost\r\n\r\n"):
            answer = self.service.send_raw(data)
            self.assertEqual((answer.status, answer.content_type), (400, "application/problem+json"), f"{data}: {answer}")
            self.assertEqual(answer.json()["status"], 400)
