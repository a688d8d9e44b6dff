function client(url)
%CLIENT  Drives an iRobot Create for a second, and prints what its sensors say.
%   client('rr+tcp://127.0.0.1:52222/?service=Create')
%
%   Needs the add-on "Robot Raconteur". However the drive ends, also by Ctrl-C, the robot is stopped.

create = RobotRaconteur.ConnectService(url);
print_distance(create);

RobotRaconteur.EnableEvents(create);
addlistener(create, 'Bump', @() disp('bump'));
packets = create.packets.Connect();
create.StartStreaming();

stop = onCleanup(@() finish(create));  % called when this function ends
create.Drive(int16(100), int16(32767));  % mm/s; a radius that stands for none
for step = 1:5
    pause(0.2);
    RobotRaconteur.ProcessRequests();  % calls the listener
    if packets.InValueValid
        packet = packets.InValue;
        fprintf('packet %d:%s\n', packet.ID, sprintf(' %d', packet.Data));
    end
end
end

function finish(create)
create.Drive(int16(0), int16(32767));
create.StopStreaming();
print_distance(create);
RobotRaconteur.DisconnectService(create);
end

function print_distance(create)
distance = create.DistanceTraveled;
fprintf('DistanceTraveled: %d mm\n', distance);
end
