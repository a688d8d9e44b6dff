"""Users of a gateway: their files, their rights and the headers by which they show who they are."""
import base64

from gateways import rrgate

PASSWORDS = {"alice": "wonderland", "vera": "look only", "root": "of it all"}
ROLES = {"alice": "operator", "vera": "viewer", "root": "admin"}
RULES = [
    {"roles": ["viewer", "operator"], "may": ["read", "subscribe"]},
    {"roles": ["operator"], "paths": ["interop"], "members": ["p_double", "add"], "may": ["write", "call"]},
    {"roles": ["admin"], "may": ["read", "write", "call", "subscribe", "lock", "metrics", "admin"]},
]


def make_users(folder):
    for name, password in PASSWORDS.items():
        rrgate("passwd", folder / "users", name, "--roles", ROLES[name], given=password + "\n")


def basic(name, password=None):
    text = f"{name}:{PASSWORDS[name] if password is None else password}"
    return {"Authorization": "Basic " + base64.b64encode(text.encode()).decode()}


def bearer(token):
    return {"Authorization": "Bearer " + token}
