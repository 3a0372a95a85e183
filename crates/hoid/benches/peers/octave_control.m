% The ARX fit of GNU Octave's control package; it has no Box-Jenkins fit and no recursions. Called as
% `octave-cli octave_control.m RECORD.csv RUNS`; prints the lines of JSON that _peer.py describes.
1;
arguments = argv ();
try
  pkg load control
  record = dlmread (arguments{1}, ",");
  runs = str2double (arguments{2});
  packages = pkg ("list", "control");
  peer = sprintf ("octave %s, control %s", version (), packages{1}.version);
  % B begins at lag 1; the rest of the delay is taken out of the data, as the package has none for this fit.
  fit = @() arx (iddata (record(29:end,2), record(1:end-28,1), 0.01), "na", 2, "nb", 2);
  model = fit ();
  times = zeros (1, runs);
  for k = 1:runs
    begun = tic ();
    model = fit ();
    times(k) = toc (begun);
  end
  [num, den] = tfdata (model);
  printf ("{\"task\": \"arx\", \"peer\": \"%s\", \"seconds\": %.9g, \"answer\": [%.15g, %.15g, %.15g, %.15g]}\n", ...
          peer, median (times), den{1,1}(2), den{1,1}(3), num{1,1}(1), num{1,1}(2));
catch failure
  printf ("{\"task\": \"arx\", \"peer\": \"octave control\", \"skipped\": \"%s\"}\n", strrep (failure.message, "\"", "'"));
end
