function client_http(gateway)
%CLIENT_HTTP  Drives an iRobot Create for a second, and prints what its sensors say, by HTTP.
%   client_http('http://127.0.0.1:8080')
%
%   For MATLAB, and for Octave 7 or later with the program curl. However the drive ends, also by Ctrl-C, the robot is
%   stopped: by this function, or, where this program hangs or dies, by the gateway, which then ends the lease.

create = [gateway '/api/v1/devices/create/Create'];
print_distance(create);
call(create, 'StartStreaming', struct(), '');
lease = post([create '?lease=acquire&deadman=2000'], struct(), '');
key = lease.lease;
stop = onCleanup(@() finish(create, key));  % called when this function ends

call(create, 'Drive', struct('velocity', 100, 'radius', 32767), key);  % mm/s; a radius that stands for none
for step = 1:5
    pause(0.2);
    post([create '?lease=renew'], struct(), key);
    packet = get_value(create, 'packets');
    fprintf('packet %d:%s\n', packet.ID, sprintf(' %d', matlab.net.base64decode(packet.Data)));
end
end

function finish(create, key)
call(create, 'Drive', struct('velocity', 0, 'radius', 32767), key);
call(create, 'StopStreaming', struct(), key);
post([create '?lease=release'], struct(), key);
print_distance(create);
end

function print_distance(create)
fprintf('DistanceTraveled: %d mm\n', get_value(create, 'DistanceTraveled'));
end

function value = get_value(object, member)
value = jsondecode(webread([object '/' member], weboptions('ContentType', 'text')));
end

function result = call(object, name, arguments, key)
answer = post([object '/' name], arguments, key);
result = answer.result;
end

function answer = post(url, body, key)
% The gateway's answer; [] where it has none. The key names the lease.
body = jsonencode(body);
if exist('OCTAVE_VERSION', 'builtin')  % its webwrite sends forms alone
    [status, text] = system(sprintf(['curl -sS --fail-with-body --max-time 5 -H "Content-Type: application/json" ' ...
                                     '-H "Rrgate-Lease: %s" -d ''%s'' "%s"'], key, body, url));
    if status ~= 0
        error('%s: %s', url, text);
    end
else
    options = weboptions('MediaType', 'application/json', 'ContentType', 'text');
    if ~isempty(key)
        options.HeaderFields = {'Rrgate-Lease', key};
    end
    text = webwrite(url, body, options);
end
answer = [];
if ~isempty(text)
    answer = jsondecode(text);
end
end
