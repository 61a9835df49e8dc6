# The page and the commands in a container, as a user without rights and with a root that is read-only:
#   docker build -t dockpose .
#   docker run --rm --read-only --tmpfs /tmp -v dockpose:/data -p 127.0.0.1:8080:8080 dockpose
#   docker run --rm --read-only --tmpfs /tmp -v "$PWD":/data dockpose estimate tank.png --camera tank.yaml ...
# and an extension of BlueOS, by its labels: docs/vehicle.md. For a vehicle: docker buildx build --platform linux/arm64 ...
FROM python:3.13-slim AS build
COPY . /source
RUN python -m venv /opt/dockpose && /opt/dockpose/bin/python -m pip install --no-cache-dir '/source[mavlink]'
# What libraries test themselves with, and pip, are 70 MB.
RUN find /opt/dockpose -type d -name tests -prune -exec rm -r {} + && /opt/dockpose/bin/python -m pip uninstall --yes --quiet pip
# Compiles the loops over pixels, which would otherwise take a minute of every start. What is kept of them belongs to
# source files of a certain time, of which an image keeps whole seconds.
ENV NUMBA_CACHE_DIR=/opt/dockpose/compiled
RUN find /opt/dockpose -name "*.py" -exec touch -d 2026-01-01 {} +
RUN /opt/dockpose/bin/dockpose estimate sample_images --json /dev/null

FROM python:3.13-slim
COPY --from=build /opt/dockpose /opt/dockpose
RUN useradd --uid 1000 --no-create-home dockpose && install -d -o dockpose -g dockpose /data
ENV PATH=/opt/dockpose/bin:$PATH \
    NUMBA_CACHE_DIR=/tmp/compiled \
    MPLCONFIGDIR=/tmp/matplotlib \
    XDG_CONFIG_HOME=/data/settings \
    PYTHONDONTWRITEBYTECODE=1 \
    PYTHONUNBUFFERED=1
LABEL version="0.3.0" \
    type="tool" \
    requirements="core >= 1.4" \
    authors='[{"name": "dockpose developers", "email": ""}]' \
    company='{"about": "", "name": "dockpose developers", "email": ""}' \
    readme="/extensionv2/dockpose/help" \
    links='{"documentation": "/extensionv2/dockpose/help"}' \
    permissions='{"HostConfig": {"NetworkMode": "host", "Binds": ["dockpose:/data"]}, "Env": ["DOCKPOSE_SOURCE=blueos://127.0.0.1", "DOCKPOSE_ALLOW_FRAME=http://blueos.local http://192.168.2.2", "DOCKPOSE_ALLOW_HOST=blueos.local"]}'
USER 1000:1000
WORKDIR /data
VOLUME /data
EXPOSE 8080
# With the token that the page keeps beside its settings.
HEALTHCHECK --interval=30s --timeout=5s --start-period=60s CMD ["python", "-c", "import http.client, pathlib; token = pathlib.Path('/data/settings/dockpose/token-8080').read_text().strip(); page = http.client.HTTPConnection('127.0.0.1', 8080, timeout=4); page.request('GET', '/alive?token=' + token); raise SystemExit(page.getresponse().status >= 400)"]
# What is compiled can only be used where it can be written, so it goes into the temporary folder first.
ENTRYPOINT ["sh", "-c", "cp -R /opt/dockpose/compiled /tmp/ 2>/dev/null; chmod -R u+w /tmp/compiled; exec dockpose \"$@\"", "dockpose"]
CMD ["serve", "--host", "0.0.0.0", "--sessions", "/data/sessions", "--resume"]
