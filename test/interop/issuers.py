"""What an operator's other programs make: JSON Web Tokens, and certificates of people."""
import base64
import collections
import datetime
import hashlib
import hmac
import http.server
import json
import ssl
import threading
import time

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec, ed25519, padding, rsa, utils
from cryptography.x509.oid import NameOID

ALGORITHMS = ("RS256", "ES256", "EdDSA")


def encoded(data):
    data = data if isinstance(data, bytes) else json.dumps(data).encode()
    return base64.urlsafe_b64encode(data).rstrip(b"=").decode()


def number(value, size=None):
    return encoded(value.to_bytes(size or (value.bit_length() + 7) // 8, "big"))


class Issuer:
    """`generation` is a part of its keys' names: another one has other keys."""

    def __init__(self, name, audience, generation=""):
        self.name, self.audience, self.generation = name, audience, generation
        self.rsa = rsa.generate_private_key(public_exponent=65537, key_size=2048)
        self.ec = ec.generate_private_key(ec.SECP256R1())
        self.ed = ed25519.Ed25519PrivateKey.generate()

    def key_set(self):
        public = self.rsa.public_key().public_numbers()
        point = self.ec.public_key().public_numbers()
        raw = self.ed.public_key().public_bytes(serialization.Encoding.Raw, serialization.PublicFormat.Raw)
        return {"keys": [
            {"kty": "RSA", "kid": "RS256" + self.generation, "use": "sig", "alg": "RS256", "n": number(public.n), "e": number(public.e)},
            {"kty": "EC", "kid": "ES256" + self.generation, "crv": "P-256", "x": number(point.x, 32), "y": number(point.y, 32)},
            {"kty": "OKP", "kid": "EdDSA" + self.generation, "crv": "Ed25519", "x": encoded(raw)},
        ]}

    def _text(self, user, roles, header, seconds=600):
        claims = {"iss": self.name, "aud": [self.audience], "sub": user, "roles": roles, "exp": int(time.time()) + seconds}
        return encoded(header) + "." + encoded(claims)

    def token(self, user, roles, algorithm, seconds=600):
        text = self._text(user, roles, {"alg": algorithm, "kid": algorithm + self.generation, "typ": "JWT"}, seconds)
        if algorithm == "RS256":
            signature = self.rsa.sign(text.encode(), padding.PKCS1v15(), hashes.SHA256())
        elif algorithm == "ES256":
            r, s = utils.decode_dss_signature(self.ec.sign(text.encode(), ec.ECDSA(hashes.SHA256())))
            signature = r.to_bytes(32, "big") + s.to_bytes(32, "big")
        else:
            signature = self.ed.sign(text.encode())
        return text + "." + encoded(signature)

    def unsigned(self, user, roles):
        return self._text(user, roles, {"alg": "none"}) + "."

    def signed_with_public_key(self, user, roles):
        """With what everybody knows, taken for a secret."""
        secret = self.rsa.public_key().public_bytes(serialization.Encoding.PEM, serialization.PublicFormat.SubjectPublicKeyInfo)
        text = self._text(user, roles, {"alg": "HS256", "kid": "RS256"})
        return text + "." + encoded(hmac.digest(secret, text.encode(), hashlib.sha256))


class IssuerServer:
    """Publishes an issuer's keys by HTTPS. `silent`: takes connections, and answers nothing for as long."""

    def __init__(self, certificate, key):
        self.key_set, self.name, self.asked, self.silent = {"keys": []}, None, collections.Counter(), False
        owner = self

        class Handler(http.server.BaseHTTPRequestHandler):
            def do_GET(self):
                owner.asked[self.path] += 1
                while owner.silent:
                    time.sleep(0.02)
                body = json.dumps(owner.key_set if self.path == "/keys" else
                                  {"issuer": owner.name or owner.url, "jwks_uri": owner.url + "/keys"}).encode()
                self.send_response(200)
                self.send_header("Content-Length", str(len(body)))
                self.end_headers()
                self.wfile.write(body)

            def log_message(self, *arguments):
                pass

        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        context.load_cert_chain(certificate, key)
        self._server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self._server.socket = context.wrap_socket(self._server.socket, server_side=True)
        self.url = f"https://localhost:{self._server.server_port}"
        threading.Thread(target=self._server.serve_forever, daemon=True).start()

    def stop(self):
        self.silent = False
        self._server.shutdown()
        self._server.server_close()


class People:
    """A CA, and certificates of it by name. `above`: the CA that vouches for it, if it is no root."""

    def __init__(self, folder, name="People of the lab", above=None):
        folder.mkdir(exist_ok=True)
        self.folder, self.ca, self._above = folder, folder / "people-ca.pem", above
        self._key = ec.generate_private_key(ec.SECP256R1())
        self._name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])
        self.ca.write_bytes((above or self)._make(self._name, self._key, True).public_bytes(serialization.Encoding.PEM))

    def _make(self, name, key, is_ca, seconds=86400):
        now = datetime.datetime.now(datetime.timezone.utc)
        return x509.CertificateBuilder().subject_name(name).issuer_name(self._name).public_key(key.public_key()) \
            .serial_number(x509.random_serial_number()).not_valid_before(now - datetime.timedelta(hours=1)) \
            .not_valid_after(now + datetime.timedelta(seconds=seconds)) \
            .add_extension(x509.BasicConstraints(is_ca, None), True).sign(self._key, hashes.SHA256())

    def revoke(self, *certificates):
        """Writes a list that revokes them; returns its file."""
        now = datetime.datetime.now(datetime.timezone.utc)
        made = x509.CertificateRevocationListBuilder().issuer_name(self._name).last_update(now - datetime.timedelta(hours=1)) \
            .next_update(now + datetime.timedelta(days=1))
        for file in certificates:
            serial = x509.load_pem_x509_certificate(file.read_bytes()).serial_number
            made = made.add_revoked_certificate(x509.RevokedCertificateBuilder().serial_number(serial).revocation_date(now).build())
        new = self.folder / "crl.new"
        new.write_bytes(made.sign(self._key, hashes.SHA256()).public_bytes(serialization.Encoding.PEM))
        return new.rename(self.folder / "crl.pem")

    def certificate(self, name, seconds=86400):
        """The files of certificate and key."""
        key = ec.generate_private_key(ec.SECP256R1())
        made = self._make(x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)]), key, False, seconds)
        files = self.folder / f"{name}.pem", self.folder / f"{name}.key"
        files[0].write_bytes(made.public_bytes(serialization.Encoding.PEM) + (self.ca.read_bytes() if self._above else b""))
        files[1].write_bytes(key.private_bytes(serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8,
                                               serialization.NoEncryption()))
        return files
