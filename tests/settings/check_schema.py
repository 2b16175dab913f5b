"""Judges the schemas that a program prints with jsonschema: valid 2020-12, and the same verdict as our reader on
every sample. Run: check_schema.py PROGRAM"""
import json
import subprocess
import sys

import jsonschema


def main():
    printed = subprocess.run([sys.argv[1]], check=True, capture_output=True, text=True).stdout
    wrong = []
    for entry in json.loads(printed):
        schema = entry["schema"]
        assert schema["$schema"] == "https://json-schema.org/draft/2020-12/schema"
        jsonschema.Draft202012Validator.check_schema(schema)
        validator = jsonschema.Draft202012Validator(schema)
        verdicts = set()
        for case in entry["cases"]:
            accepted = validator.is_valid(json.loads(case["text"]))
            verdicts.add(accepted)
            if accepted != (case["refusal"] == ""):
                wrong.append(f"{schema['title']}: {case['text']}: schema {'accepts' if accepted else 'refuses'},"
                             f" reader: {case['refusal'] or 'accepts'}")
        assert verdicts == {True, False}, "samples of both kinds are needed"
    print("\n".join(wrong))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
