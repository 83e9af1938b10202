# The tutorial's mission with ROS on Debian 13, and its page in the browser:
#
#     docker build --tag quad .
#     docker run --rm -p 127.0.0.1:8080:8080 quad config:=tutorial
#
# The page is at the address that is printed, on the host with 127.0.0.1 in it.

FROM debian:13 AS system
RUN useradd --create-home quad && install --directory --owner=quad /home/quad/quad
WORKDIR /home/quad/quad
# A change of the sources keeps the layers with system packages and virtual environment.
COPY pyproject.toml ./
COPY scripts/check_python.py scripts/chromium scripts/common.sh scripts/install_packages scripts/packages-debian.txt scripts/
ARG OPTIONS=
RUN scripts/install_packages $OPTIONS && apt-get clean && rm -rf /var/lib/apt/lists/*
USER quad

FROM system
COPY --chown=quad requirements.txt requirements-web.txt ./
COPY --chown=quad scripts/make_venv scripts/
RUN scripts/make_venv .venv requirements.txt requirements-web.txt && rm -rf ~/.cache
COPY --chown=quad . .
RUN make workspace
EXPOSE 8080
ENTRYPOINT ["bash", "-c", "exec scripts/ros_env scripts/fly web:=true web_port:=8080 web_address:=$(hostname -i | cut -d ' ' -f 1) \"$@\"", "fly"]
