"""A running `skylight serve`, and a client that takes nothing for granted."""
import http.client
import json
import os
import queue
import re
import signal
import socket
import subprocess
import tempfile
import threading
import time
import urllib.parse

START_WITHIN_S = 90
ANSWER_WITHIN_S = 30


def environment():
    """Ours, without settings of Skylight that would change what is tested."""
    return {name: value for name, value in os.environ.items() if not name.startswith("SKYLIGHT_")}


class Answer:
    def __init__(self, status, headers, body):
        self.status = status
        self.headers = headers  # names in lower case
        self.body = body

    @property
    def content_type(self):
        return self.headers.get("content-type", "").split(";")[0].strip()

    def json(self):
        def refuse(word):
            raise ValueError(f"{word} is no JSON")
        return json.loads(self.body.decode("utf-8"), parse_constant=refuse)

    def __str__(self):
        return f"{self.status} {self.content_type} {self.body[:600]!r}"


class Service:
    """The program under test; one for all cases."""

    def __init__(self, program, scenario=None, settings=(), config=None, ready=True):
        """Over a scenario, or what a configuration file says; `ready`: waits until frames are tracked."""
        command = [program, "serve", "--port", "0"]
        command += ["--scenario", scenario] if scenario else ["--config", config]
        for setting in settings:
            command += ["--set", setting]
        self._log = tempfile.TemporaryFile(mode="w+", encoding="utf-8", errors="replace")
        self._process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=self._log, text=True,
                                         env=environment())
        try:
            self.port = self._read_port()
            if ready:
                self._wait_until_ready()
        except BaseException:
            self._process.kill()
            self._process.wait()
            raise

    def _read_port(self):
        lines = queue.Queue()
        threading.Thread(target=lambda: [lines.put(line) for line in self._process.stdout], daemon=True).start()
        try:
            line = lines.get(timeout=START_WITHIN_S)
        except queue.Empty:
            raise AssertionError(f"skylight serve printed no address; its log:\n{self.log()}") from None
        address = re.search(r"http://127\.0\.0\.1:(\d+)/", line)
        assert address, f"skylight serve printed {line!r} instead of its address; its log:\n{self.log()}"
        return int(address.group(1))

    def _wait_until_ready(self):
        answer = wait_for(lambda: self.request("GET", "/readyz"), lambda a: a.status == 200, START_WITHIN_S)
        assert answer.status == 200, f"/readyz: {answer}; log:\n{self.log()}"

    def log(self):
        self._log.seek(0)
        return self._log.read()[-4000:]

    def request(self, method, path, body=None, headers=None):
        """One request on a connection of its own. `body`: a value for JSON, or bytes as they are."""
        sent = dict(headers or {})
        if body is not None and not isinstance(body, bytes):
            body = json.dumps(body).encode()
        if body is not None:
            sent.setdefault("Content-Type", "application/json")
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=ANSWER_WITHIN_S)
        try:
            connection.request(method, path, body=body, headers=sent)
            answer = connection.getresponse()
            names = {name.lower(): value for name, value in answer.getheaders()}
            return Answer(answer.status, names, answer.read())
        except OSError as error:
            raise AssertionError(f"{method} {path}: no answer ({error}); log:\n{self.log()}") from error
        finally:
            connection.close()

    def send_raw(self, data):
        """Bytes as they are; the answer is read although the service may close before it took them all."""
        with socket.create_connection(("127.0.0.1", self.port), timeout=ANSWER_WITHIN_S) as connection:
            try:
                connection.sendall(data)
            except (BrokenPipeError, ConnectionResetError):
                pass
            answer = http.client.HTTPResponse(connection)
            answer.begin()
            names = {name.lower(): value for name, value in answer.getheaders()}
            return Answer(answer.status, names, answer.read())

    def stop(self):
        """Asks it to stop, as an operator would; the exit code."""
        self._process.send_signal(signal.SIGTERM)
        try:
            return self._process.wait(timeout=60)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
            raise AssertionError(f"skylight serve did not stop; its log:\n{self.log()}") from None


def wait_for(ask, good, within_s):
    """What ask() gives once it is good, or the last it gave when the time is up."""
    end = time.monotonic() + within_s
    while True:
        got = ask()
        if good(got) or time.monotonic() > end:
            return got
        time.sleep(0.1)


def with_query(path, query):
    return path + "?" + urllib.parse.urlencode(query, doseq=True) if query else path
